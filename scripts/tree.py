"""The behaviour tree, live: `python3 scripts/tree.py [--namespace /striker]` while the nodes run; Ctrl-C ends it."""

from __future__ import annotations

import sys

import _environment


def main() -> int:
    """Show the tree; return the exit code: 0 after Ctrl-C, 2 when no strategy is heard."""
    import typer

    from tulip_ros import network
    from tulip_ros.errors import EXIT_BAD_INPUT, BadInputError
    from tulip_ros.plan import check_namespace
    from tulip_strategy import tree_node

    def tree(
        namespace: str = typer.Option("", help="Namespace of the robot, as in /striker."),
        whole: bool = typer.Option(False, help="Also branches that were not asked."),
        peers: str = typer.Option("", network.OPTION, metavar=network.METAVAR, help=network.HELP),
    ) -> None:
        """Show what the robot decides, and why: ▶ runs, ✓ holds or is done, ✗ does not hold."""
        try:
            namespace = check_namespace(namespace)
            network.join(peers)
            remap = ["-r", f"__ns:=/{namespace}"] if namespace else []
            tree_node.main([sys.argv[0], "--ros-args", *remap], whole)
        except BadInputError as error:
            typer.echo(f"error: {error}", err=True)
            raise typer.Exit(EXIT_BAD_INPUT) from None

    typer.run(tree)
    return 0


if __name__ == "__main__":
    _environment.prepare()
    raise SystemExit(main())

"""The text menu of the user input: `python3 scripts/menu.py [--namespace /striker]` while the nodes run."""

from __future__ import annotations

import sys

import _environment


def main() -> int:
    """Show the menu; return the exit code: 0 after quitting, 2 when user input is not there."""
    import typer

    from tulip_ros.errors import EXIT_BAD_INPUT, BadInputError
    from tulip_ros.plan import check_namespace
    from tulip_strategy import menu_node

    def menu(namespace: str = typer.Option("", help="Namespace of the robot, as in /striker.")) -> None:
        """Tell the robot what to do: start, stop, stand, walk test, kick test, limp, strategy, record."""
        try:
            namespace = check_namespace(namespace)
            remap = ["-r", f"__ns:=/{namespace}"] if namespace else []
            menu_node.main([sys.argv[0], "--ros-args", *remap])
        except BadInputError as error:
            typer.echo(f"error: {error}", err=True)
            raise typer.Exit(EXIT_BAD_INPUT) from None

    typer.run(menu)
    return 0


if __name__ == "__main__":
    _environment.prepare()
    raise SystemExit(main())

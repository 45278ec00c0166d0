"""One transport, measured in a process of its own: Fast DDS reads its profile once in a process's life.

python -m tulip_sim.bench.transports.trial prints the figures as JSON. The profile is the environment's.
"""

from __future__ import annotations

import json

from tulip_ros import transport
from tulip_sim.bench.transports import pictures, restarts

if __name__ == "__main__":
    transport.remove_leftovers()
    try:
        print(json.dumps({**restarts.measure(), **pictures.measure()}))
    finally:
        transport.remove_leftovers()

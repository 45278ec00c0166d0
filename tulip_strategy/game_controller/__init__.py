"""What the referee program (GameController) and the robots say to each other, in every version of its protocol.

- layout.py: tables of fields as bytes, and packets as named values;
- versions.py: the table of each version;
- packets.py: decode and encode;
- meaning.py and penalties.py: what the numbers of a packet stand for;
- replies.py: what a robot sends back, and to which port.
"""

from __future__ import annotations

from tulip_strategy.game_controller.layout import Packet, make_packet
from tulip_strategy.game_controller.packets import PACKET_MAGIC, Fault, Rejected, decode, encode
from tulip_strategy.game_controller.replies import (
    REPLY_MAGIC,
    Reply,
    ReplyMessage,
    RobotStatus,
    decode_reply,
    encode_reply,
)
from tulip_strategy.game_controller.versions import LAYOUTS, REFEREE_PORT, TeamColour, layout_of

__all__ = [
    "LAYOUTS",
    "PACKET_MAGIC",
    "REFEREE_PORT",
    "REPLY_MAGIC",
    "Fault",
    "Packet",
    "Rejected",
    "Reply",
    "ReplyMessage",
    "RobotStatus",
    "TeamColour",
    "decode",
    "decode_reply",
    "encode",
    "encode_reply",
    "layout_of",
    "make_packet",
]

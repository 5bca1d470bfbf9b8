"""The PyPI client `dryve-d1` homes and moves an axis: run in an environment of its own, with the port as argument.

Prints what it saw, as JSON.
"""

import asyncio
import json
import sys

from dryve_d1 import DryveD1
from dryve_d1.api.drive import DryveD1Config
from dryve_d1.config.models import ConnectionConfig, DriveConfig, MotionLimits
from dryve_d1.motion.homing import HomingConfig
from dryve_d1.protocol.exceptions import ModbusGatewayException

TARGETS = (3_000_000, 1_000_000)
"""Where to move after homing [increments]: some 30 mm and 10 mm from the switch."""

STROKE = 5_000_000
SPEED, ACCELERATION = 2_000_000, 20_000_000
PATIENCE = 90.0


async def main(port: int, unit: int) -> None:
    connection = ConnectionConfig(host="127.0.0.1", port=port, unit_id=unit, request_timeout_s=30.0)
    limits = MotionLimits(min_position_limit=0, max_position_limit=STROKE)
    drive = DryveD1(
        config=DryveD1Config(
            drive=DriveConfig(connection=connection, limits=limits),
            homing=HomingConfig(speed_search=SPEED, speed_switch=SPEED // 10, acceleration=ACCELERATION, timeout_s=PATIENCE),
        )
    )
    await drive.connect()
    seen: dict[str, object] = {"limits": await drive.get_position_limits(), "homed before": await drive.is_homed()}
    homing = await drive.home(timeout_s=PATIENCE)
    seen |= {"attained": homing.attained, "error": homing.error, "homed": await drive.is_homed()}
    seen["positions"] = [await moved(drive, target) for target in TARGETS]
    seen["window"] = await drive.read_u32(0x6067)
    seen["refused"] = [await refused(drive, 0x607D), await refused(drive, 0x6041)]
    await drive.disable_voltage()
    seen["statusword"] = await drive.read_u16(0x6041)
    await drive.close()
    print(json.dumps(seen))


async def moved(drive: DryveD1, target: int) -> int:
    await drive.move_to_position(
        target_position=target, velocity=SPEED, accel=ACCELERATION, decel=ACCELERATION, timeout_s=PATIENCE
    )
    position: int = await drive.get_position_live()
    return position


async def refused(drive: DryveD1, index: int) -> str:
    """Function and exception code of a write that the drive has to refuse."""
    try:
        await drive.write_u16(index, 0, 0)
    except ModbusGatewayException as error:
        return f"{error.function_code:02X} {error.exception_code:02X}"
    return "taken"


if __name__ == "__main__":
    asyncio.run(main(int(sys.argv[1]), int(sys.argv[2])))

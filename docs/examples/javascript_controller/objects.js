// The objects of a drive that this controller uses: index, sub-index, type; of CiA 301, CiA 402-2 and the ServoOne.
'use strict';

const { DataType } = require('canopen');

const { INTEGER8: I8, INTEGER16: I16, INTEGER32: I32, REAL32: R32, UNSIGNED8: U8, UNSIGNED16: U16, UNSIGNED32: U32 } = DataType;
const BITS = { [I8]: 8, [U8]: 8, [I16]: 16, [U16]: 16, [I32]: 32, [U32]: 32, [R32]: 32 };
const at = (index, subIndex, type) => ({ index, subIndex, type, bits: BITS[type] });

module.exports = {
    DEVICE_TYPE: at(0x1000, 0, U32),
    CYCLE_PERIOD: at(0x1006, 0, U32), // us
    HEARTBEAT_TIME: at(0x1017, 0, U16), // ms
    BUS_TIMEOUT_TYPE: at(0x280d, 0, U16), // ServoOne P2061; 1: the drive supervises SYNC
    BUS_TIMEOUT: at(0x280e, 0, U16), // ServoOne P2062, ms
    FOLLOWING_ERROR_LIMIT: at(0x22e7, 0, U32), // ServoOne P743, position units
    INTERPOLATION_TYPE: at(0x2172, 0, U16), // ServoOne P370; 2: cubic spline
    MOTOR_INERTIA: at(0x21cd, 0, R32), // ServoOne P461, kg m2
    CONTROLWORD: at(0x6040, 0, U16),
    STATUSWORD: at(0x6041, 0, U16),
    QUICK_STOP_OPTION: at(0x605a, 0, I16),
    FAULT_REACTION_OPTION: at(0x605e, 0, I16),
    MODE: at(0x6060, 0, I8),
    MODE_DISPLAY: at(0x6061, 0, I8),
    POSITION: at(0x6064, 0, I32),
    HOME_OFFSET: at(0x607c, 0, I32),
    POLARITY: at(0x607e, 0, U8),
    MOST_SPEED: at(0x607f, 0, U32),
    ACCELERATION: at(0x6083, 0, U32),
    DECELERATION: at(0x6084, 0, U32),
    QUICK_STOP_DECELERATION: at(0x6085, 0, U32),
    GEAR_MOTOR_TURNS: at(0x6091, 1, U32),
    GEAR_SHAFT_TURNS: at(0x6091, 2, U32),
    FEED: at(0x6092, 1, U32),
    FEED_SHAFT_TURNS: at(0x6092, 2, U32),
    HOMING_METHOD: at(0x6098, 0, I8),
    HOMING_SEARCH_SPEED: at(0x6099, 1, U32),
    HOMING_EDGE_SPEED: at(0x6099, 2, U32),
    HOMING_ACCELERATION: at(0x609a, 0, U32),
    SETPOINT: at(0x60c1, 1, I32),
    INTERPOLATION_PERIOD: at(0x60c2, 1, U8),
    INTERPOLATION_EXPONENT: at(0x60c2, 2, I8),
    SUPPORTED_MODES: at(0x6502, 0, U32),
    U8, U32, at,
};

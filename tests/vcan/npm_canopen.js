// A CANopen master made of npm's `canopen` and `socketcan`: one scenario a run, and what it saw as one line of JSON.
//   node npm_canopen.js SCENARIO EDS [FILE]      (an EDS that `drivetwin eds` wrote; the drive is node 1 on vcan0)
'use strict';

const fs = require('fs');
const { Device, DataType, Eds, LssMode, ObjectType } = require('canopen');
const can = require('socketcan');

const MASTER = 0x7f, DRIVE = 1;
const PATIENCE = 60000; // longest wait for an answer [ms]; nothing is asserted on how long it took
const BIT = 500; // wait for the answer that does not come, in a fastscan [ms]
const OPERATION_ENABLED = 0x27, STATE = 0x6f;

/** The drive's EDS with the values that node-ID 1 has: the client takes `$NODEID+...` for 0. */
function edsOfNode(path) {
    const eds = Eds.fromFile(path);
    for (const entry of [...eds.values()].flatMap((e) => [e, ...(e.subNumber ? e._subObjects : [])])) {
        const formula = /^\$NODEID\+(\w+)$/.exec(entry?.defaultValue ?? '');
        if (formula)
            entry.value = Number(formula[1]) + DRIVE;
    }
    return eds;
}

/** The master, in state operational, with the drive mapped from its EDS: SDO, EMCY, TPDOs; and heartbeats where asked for. */
function startMaster(channel, eds) {
    const device = new Device({ id: MASTER });
    device.addListener('message', (message) => channel.send({ ...message, ext: false, rtr: false }));
    channel.addListener('onMessage', (message) => device.receive(message));
    device.mapRemoteNode({ id: DRIVE, eds });
    device.eds.setSyncCobId(0x80);
    device.eds.setSyncGenerationEnable(true);
    device.eds.setTimeCobId(0x100);
    device.eds.setTimeProducerEnable(true);
    device.start();
    device.nmt.startNode();
    return device;
}

/** The drive as this master sees it. */
class Drive {
    constructor(device) {
        this.device = device;
    }

    read(index, subIndex, dataType, options = {}) {
        return this.device.sdo.upload({ deviceId: DRIVE, index, subIndex, dataType, timeout: PATIENCE, ...options });
    }

    write(index, subIndex, data, dataType, options = {}) {
        return this.device.sdo.download({ deviceId: DRIVE, index, subIndex, data, dataType, timeout: PATIENCE, ...options });
    }
}

/** The next event of an emitter that fulfils a condition. */
function event(emitter, name, condition = () => true) {
    return new Promise((resolve, reject) => {
        const timer = setTimeout(() => reject(new Error(`no ${name}`)), PATIENCE);
        emitter.on(name, function listen(value) {
            if (!condition(value))
                return;
            clearTimeout(timer);
            emitter.removeListener(name, listen);
            resolve(value);
        });
    });
}

const scenarios = {
    /** What the client reads in the EDS, before anything is filled in. */
    async eds(_, path) {
        const eds = Eds.fromFile(path);
        const target = eds.getEntry(0x607a);
        return {
            objects: [...eds.keys()].length, product: eds.productName, lss: eds.lssSupported,
            pdos: [eds.nrOfRXPDO, eds.nrOfTXPDO].map(Number), identity: eds.getIdentity(),
            target: [target.parameterName, target.dataTypeString, target.accessType],
            formula: [eds.getEntry(0x1014).defaultValue, eds.getEmcyCobId()],
        };
    },

    /** Expedited and segmented transfers. */
    async sdo({ drive }) {
        const note = 'a text of more than one segment, written and read by canopen of npm';
        await drive.write(0x607a, 0, -123456, DataType.INTEGER32);
        await drive.write(0x6066, 0, 65535, DataType.UNSIGNED16);
        await drive.write(0x60f9, 1, 1.5, DataType.REAL32);
        await drive.write(0x2f00, 0, note, DataType.VISIBLE_STRING);
        return {
            type: await drive.read(0x1000, 0, DataType.UNSIGNED32),
            position: await drive.read(0x607a, 0, DataType.INTEGER32),
            time: await drive.read(0x6066, 0, DataType.UNSIGNED16),
            gain: await drive.read(0x60f9, 1, DataType.REAL32),
            name: await drive.read(0x1008, 0, DataType.VISIBLE_STRING),
            faithful: await drive.read(0x2f00, 0, DataType.VISIBLE_STRING) === note,
        };
    },

    /** A value of every type of a fixed length, written and read; what is not read as it was written says what came. */
    async types({ drive }) {
        const code = (transfer) => transfer.then(() => 'none', (error) => error.code.toString(16));
        const values = {
            INTEGER8: -128, INTEGER16: -32768, INTEGER24: -8388608, INTEGER32: -2147483648, INTEGER40: -549755813888,
            INTEGER48: -140737488355328, INTEGER64: -9223372036854775808n, UNSIGNED8: 255, UNSIGNED16: 65535,
            UNSIGNED24: 16777215, UNSIGNED32: 4294967295, UNSIGNED40: 1099511627775, UNSIGNED48: 281474976710655,
            UNSIGNED64: 18446744073709551615n, REAL32: -1.5, REAL64: 0.1,
        };
        const faithful = [];
        for (const [name, value] of Object.entries(values)) {
            const index = 0x2f00 + DataType[name];
            await drive.write(index, 0, value, DataType[name]);
            if (await drive.read(index, 0, DataType[name]) === value)
                faithful.push(name);
        }
        const day = new Date(Date.UTC(2024, 1, 29, 12, 34, 56, 789));
        for (const name of ['TIME_OF_DAY', 'TIME_DIFFERENCE']) {
            const index = 0x2f00 + DataType[name];
            await drive.write(index, 0, day, DataType[name]);
            if ((await drive.read(index, 0, DataType[name])).getTime() === day.getTime())
                faithful.push(name);
        }
        const refused = {};
        for (const name of ['INTEGER56', 'UNSIGNED56'])
            refused[name] = await code(drive.write(0x2f00 + DataType[name], 0, 1n, DataType[name]));
        return { faithful, refused };
    },

    /** Block transfers of more than one block each way, with CRC. */
    async block({ drive }) {
        const lengths = [];
        for (const length of [1, 7, 889, 890, 2000]) {
            const text = Array.from({ length }, (_, i) => String.fromCharCode(33 + i % 90)).join('');
            await drive.write(0x2f00, 0, text, DataType.VISIBLE_STRING, { blockTransfer: true, blockInterval: 0 });
            const blocks = await drive.read(0x2f00, 0, DataType.VISIBLE_STRING, { blockTransfer: true });
            const segments = await drive.read(0x2f00, 0, DataType.VISIBLE_STRING);
            if (blocks === text && segments === text)
                lengths.push(length);
        }
        return { lengths };
    },

    /** A DOMAIN of more than a megabyte by blocks: the bytes of a file. */
    async domain({ drive }) {
        const data = fs.readFileSync(process.argv[4]);
        await drive.write(0x2f00 + DataType.DOMAIN, 0, data, DataType.DOMAIN, { blockTransfer: true, blockInterval: 0 });
        return { length: data.length };
    },

    /** The abort codes that the client is given. */
    async aborts({ drive }) {
        const code = (transfer) => transfer.then(() => 'none', (error) => error.code.toString(16));
        return {
            object: await code(drive.read(0x7000, 0)),
            subIndex: await code(drive.read(0x1018, 9)),
            readOnly: await code(drive.write(0x1018, 1, 4, DataType.UNSIGNED32)),
            long: await code(drive.write(0x6098, 0, 4, DataType.UNSIGNED32)),
            short: await code(drive.write(0x6081, 0, 4, DataType.UNSIGNED8)),
            high: await code(drive.write(0x6086, 0, 9, DataType.INTEGER16)),
            value: await code(drive.write(0x6060, 0, 5, DataType.INTEGER8)),
            state: await code(drive.write(0x1600, 1, 0x60400010, DataType.UNSIGNED32)),
            blockRead: await code(drive.read(0x7000, 0, null, { blockTransfer: true })),
            blockWrite: await code(drive.write(0x1018, 1, 4, DataType.UNSIGNED32, { blockTransfer: true })),
        };
    },

    /** NMT commands, told by heartbeats of one SYNC each; then a drive that falls silent. */
    async nmt({ device, drive }) {
        const { nmt, sync } = device;
        device.eds.addHeartbeatConsumer(DRIVE, 1000);
        await drive.write(0x1017, 0, 1, DataType.UNSIGNED16);
        const states = [];
        for (const command of ['startNode', 'stopNode', 'enterPreOperational', 'resetCommunication']) {
            const heartbeat = event(nmt, 'heartbeat', ({ deviceId }) => deviceId === DRIVE);
            nmt[command](DRIVE);
            if (command !== 'resetCommunication')
                sync.write();
            states.push((await heartbeat).state);
        }
        const silent = await event(nmt, 'timeout');
        const bootUp = event(nmt, 'heartbeat', ({ deviceId }) => deviceId === DRIVE);
        nmt.resetNode(DRIVE);
        return { states, silent, bootUp: (await bootUp).state };
    },

    /** A SYNC with a counter that nobody asked for: an emergency, its history, and its end. */
    async emcy({ device, drive }) {
        const told = [];
        for (const counter of [1, null]) {
            const emergency = event(device.emcy, 'emergency');
            device.sync.write(counter);
            const { cobId, em } = await emergency;
            told.push({ cobId, code: em.code, register: em.register, text: em.toString() });
        }
        const history = await drive.read(0x1003, 1, DataType.UNSIGNED32);
        return { told, history: history & 0xffff, errorRegister: await drive.read(0x1001, 0, DataType.UNSIGNED8) };
    },

    /** SYNC with the counter that 1019h asks for. */
    async sync({ device, drive }) {
        let emergencies = 0;
        device.emcy.on('emergency', () => ++emergencies);
        await drive.write(0x1019, 0, 10, DataType.UNSIGNED8);
        await drive.write(0x1017, 0, 5, DataType.UNSIGNED16);
        device.eds.addHeartbeatConsumer(DRIVE, PATIENCE);
        const heartbeat = event(device.nmt, 'heartbeat');
        let syncs = 0;
        while (device.nmt.consumers[DRIVE].state === null) {
            device.sync.write(syncs++ % 10 + 1);
            await drive.read(0x1000, 0); // the answer comes after whatever this SYNC has brought
        }
        await heartbeat;
        return { syncs, emergencies };
    },

    /** The time of day. */
    async time({ device, drive }) {
        device.time.write(new Date(Date.UTC(2024, 1, 29, 12, 34, 56, 789)));
        return { timeCobId: await drive.read(0x1012, 0, DataType.UNSIGNED32) };
    },

    /** Without a node-ID, found by fastscan, given one; then selected by its address. */
    async lss({ device, drive }) {
        const { lss, nmt } = device;
        const wait = PATIENCE;
        const identity = {
            vendorId: 0, productCode: 0x402, revisionNumber: 0x10000, serialNumber: DRIVE,
        };
        const nobody = await lss.fastscan({ timeout: BIT });
        await lss.switchModeSelective({ ...identity, timeout: wait });
        const inquired = [
            await lss.inquireVendorId(wait), await lss.inquireProductCode(wait),
            await lss.inquireRevisionNumber(wait), await lss.inquireSerialNumber(wait),
        ];
        const refused = await lss.configureNodeId(0x80, wait).then(() => 0, (error) => error.code);
        const bitTiming = await lss.configureBitTiming(0, 2, wait).then(() => 'set', (error) => error.code);
        const noBitTiming = await lss.configureBitTiming(0, 5, wait).then(() => 'set', (error) => error.code);
        await lss.configureNodeId(0xff, wait);
        lss.switchModeGlobal(LssMode.OPERATION);
        nmt.resetCommunication(DRIVE);
        const found = await lss.fastscan({ timeout: BIT });
        await lss.configureNodeId(DRIVE, wait);
        const stored = await lss.storeConfiguration(wait).then(() => 'stored', (error) => error.code);
        lss.switchModeGlobal(LssMode.OPERATION);
        return {
            nobody, inquired, refused, bitTiming, noBitTiming, found, stored,
            answers: await drive.read(0x1000, 0, DataType.UNSIGNED32),
        };
    },

    /** Enable a drive by PDO and move it in profile position, a SYNC a cycle; PDOs as the EDS maps them. */
    async motion({ device, drive, eds }) {
        await drive.write(0x1802, 1, 0x380 + DRIVE, DataType.UNSIGNED32); // TPDO 3: statusword, position; each SYNC
        await drive.write(0x1402, 1, 0x400 + DRIVE, DataType.UNSIGNED32); // RPDO 3: controlword, target position
        const [speed, ramp, way] = [1 << 21, 1 << 23, 1 << 20];
        for (const [index, value] of [[0x6081, speed], [0x6083, ramp], [0x6084, ramp], [0x6067, 1 << 12]])
            await drive.write(index, 0, value, DataType.UNSIGNED32);
        await drive.write(0x6060, 0, 1, DataType.INTEGER8);

        const [statusword, position] = device.eds.getReceivePdos().find((pdo) => pdo.cobId === 0x380 + DRIVE).dataObjects;
        const commands = [0x6040, 0x607a].map((index) => device.eds.addEntry(index, {
            parameterName: eds.getEntry(index).parameterName, objectType: ObjectType.VAR, dataType: eds.getEntry(index).dataType,
        }));
        device.eds.addTransmitPdo({ cobId: 0x400 + DRIVE, transmissionType: 255, dataObjects: commands });
        const [controlword, target] = commands;

        let syncs = 0;
        const command = (word) => {
            controlword.value = word;
            device.pdo.write(0x400 + DRIVE);
        };
        const cycle = async () => {
            const told = event(device, 'tpdo');
            device.sync.write();
            await told;
            ++syncs;
        };
        const until = async (mask, bits) => {
            while ((statusword.value & mask) !== bits)
                await cycle();
        };

        device.nmt.startNode(DRIVE);
        await cycle();
        const begin = position.value;
        target.value = begin;
        const states = [statusword.value & STATE];
        for (const [word, state] of [[0x06, 0x21], [0x07, 0x23], [0x0f, OPERATION_ENABLED]]) {
            command(word);
            await until(STATE, state);
            states.push(statusword.value & STATE);
        }
        target.value = begin + way;
        command(0x1f); // new set-point
        await until(0x1000, 0x1000); // acknowledged
        const from = syncs;
        command(0x0f);
        await until(0x1400, 0x0400); // acknowledge gone, target reached
        const cycles = syncs - from, moved = position.value - begin;
        command(0x00);
        await until(STATE, 0x40);
        states.push(statusword.value & STATE);
        return { states, way, speed, ramp, cycles, moved, mode: await drive.read(0x6061, 0, DataType.INTEGER8) };
    },
};

async function main(name, path) {
    const eds = edsOfNode(path);
    if (name === 'motion')
        eds.getSubEntry(0x1802, 1).value = 0x380 + DRIVE; // as the scenario sets it in the drive
    const channel = can.createRawChannel('vcan0');
    channel.start();
    const device = startMaster(channel, eds);
    // The client tells a PDO only where its values have changed: the cycle needs each.
    channel.addListener('onMessage', ({ id }) => { if (id === 0x380 + DRIVE) device.emit('tpdo'); });
    const seen = await scenarios[name]({ device, drive: new Drive(device), eds }, path);
    console.log(JSON.stringify(seen));
    device.stop();
    channel.stop();
}

main(process.argv[2], process.argv[3]).catch((error) => {
    console.error(error);
    process.exit(1);
});

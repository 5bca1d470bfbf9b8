// One drive as this controller sees it: its objects by SDO, its two PDOs, and what it tells of itself.
'use strict';

const { ObjectType } = require('canopen');
const O = require('./objects');
const { Trouble } = require('./trouble');

const UNIT = 1e-8; // position unit that the drives are scaled to [m or rad]
const SDO_TIMEOUT = 5000; // [ms]; a drive answers within milliseconds, a loaded host may not
const DELAY = 2; // cycles from a set-point to where the drive's cubic spline has come to it
const FOLLOWING_ERROR_TIME = 0.05; // the following error that an axis may have, as time at full speed [s]

const Nmt = { BOOT_UP: 0x00, OPERATIONAL: 0x05 };
const State = { SWITCH_ON_DISABLED: 0x40, READY: 0x21, SWITCHED_ON: 0x23, OPERATION_ENABLED: 0x27, FAULT: 0x08 };

class Drive {
    constructor(bus, name, axis) {
        Object.assign(this, { bus, name, axis, node: axis.node });
        this.feed = Math.round(axis.feed / UNIT); // position units
        this.unit = axis.feed / this.feed;
        this.answers = this.homed = false;
        this.welcome();
        const { eds, emcy } = bus.device;
        eds.addSdoClientParameter(this.node, 0x600 + this.node, 0x580 + this.node);
        eds.addEmcyConsumer(0x80 + this.node);
        emcy.addListener('emergency', ({ cobId, em }) => this.hearEmergency(cobId, em));
        this.addPdos(eds);
        bus.on(0x180 + this.node, () => this.hearPdo());
        bus.on(0x700 + this.node, ([state]) => this.hearNmt(state));
    }

    /** The two PDOs in the master's own dictionary, with objects in its manufacturer's range. */
    addPdos(eds) {
        const own = (offset, { type }) => eds.addEntry(0x2000 + 0x10 * this.node + offset, {
            parameterName: `${this.name} ${offset}`, objectType: ObjectType.VAR, dataType: type,
        });
        this.outputs = [own(0, O.CONTROLWORD), own(1, O.SETPOINT)];
        this.inputs = [own(2, O.STATUSWORD), own(3, O.POSITION)];
        eds.addTransmitPdo({ cobId: 0x200 + this.node, transmissionType: 255, dataObjects: this.outputs });
        eds.addReceivePdo({ cobId: 0x180 + this.node, transmissionType: 1, dataObjects: this.inputs });
    }

    /** From now on nothing is known against this drive. */
    welcome() {
        this.controlword = this.setpoint = 0;
        this.missed = this.age = this.silence = 0;
        this.nmtState = this.lastPosition = null;
        this.emergencies = [];
        this.sent = [];
        this.operating = this.streaming = this.watchesTravel = this.restarted = false;
    }

    // -- SDO --

    read(object) {
        return this.transfer(`reading ${place(object)}`, this.bus.device.sdo.upload(this.request(object)));
    }

    /** Write an object and read it back. */
    async write(object, value) {
        const request = { ...this.request(object), data: value };
        await this.transfer(`writing ${value} to ${place(object)}`, this.bus.device.sdo.download(request));
        const back = await this.read(object);
        if (back !== value)
            throw new Trouble(`${this.where}: ${value} was written to ${place(object)} and ${back} read back`, this.node);
    }

    request({ index, subIndex, type }) {
        return { deviceId: this.node, index, subIndex, dataType: type, timeout: SDO_TIMEOUT };
    }

    async transfer(what, transfer) {
        try {
            return await transfer;
        } catch (error) {
            throw new Trouble(`${this.where}: ${what} failed: ${error.message}`, this.node);
        }
    }

    // -- what it tells --

    hearPdo() {
        this.heard = true;
        this.onPdo?.();
    }

    hearEmergency(cobId, { code }) {
        if (cobId === 0x80 + this.node && code !== 0)
            this.emergencies.push(code);
    }

    /** A heartbeat or a boot-up message. */
    hearNmt(state) {
        this.silence = 0;
        this.nmtState = state;
        this.onNmt?.(state);
        if (state === Nmt.BOOT_UP) {
            this.restarted = true;
            this.answers = this.homed = false;
        }
    }

    get statusword() { return this.inputs[0].value; }
    get position() { return this.inputs[1].value; }
    get where() { return `axis ${this.name} (node ${this.node})`; }

    /** State of CiA 402-2, table 'State coding'; bit 5 is free where the drive has no voltage. */
    get state() {
        return this.statusword & (this.withoutVoltage ? 0x4f : 0x6f);
    }

    get withoutVoltage() {
        return [State.SWITCH_ON_DISABLED, State.FAULT].includes(this.statusword & 0x4f);
    }

    /** How far the axis is from the set-point that it was to reach by the last SYNC [position units]. */
    get followingError() {
        return Math.abs(this.sent[0] - this.position);
    }

    get followingErrorLimit() {
        return this.inUnits(FOLLOWING_ERROR_TIME * this.axis.speed);
    }

    // -- what it is told --

    /** Send the RPDO; it takes effect at the next SYNC. */
    send() {
        this.sent = [...this.sent, this.setpoint].slice(-DELAY - 1);
        this.outputs[0].value = this.controlword;
        this.outputs[1].value = this.setpoint;
        this.bus.device.pdo.write(0x200 + this.node);
    }

    /** From now on the axis follows its set-point, which is where it is held. */
    follow() {
        this.sent = [this.setpoint];
        this.streaming = true;
    }

    inUnits(value) {
        return Math.round(value / this.unit);
    }
}

function place({ index, subIndex }) {
    return `${index.toString(16).toUpperCase().padStart(4, '0')}h:${subIndex.toString(16).padStart(2, '0')}`;
}

module.exports = { Drive, Nmt, State };

// The bus: npm's `canopen` on its SocketCAN channel, and each frame by itself where the stack tells only what has changed.
'use strict';

const { Device } = require('canopen');
const socketcan = require('socketcan');

const { Trouble } = require('./trouble');

const MASTER = 0x7f;

class Bus {
    constructor(name) {
        this.listeners = new Map();
        this.channel = channelOn(name);
        this.device = new Device({ id: MASTER });
        this.device.addListener('message', ({ id, data }) => this.channel.send({ id, data, ext: false, rtr: false }));
        this.channel.addListener('onMessage', (frame) => this.receive(frame));
        this.channel.start();
        this.device.eds.setSyncCobId(0x80);
        this.device.eds.setSyncGenerationEnable(true);
        this.device.start();
        this.device.nmt.startNode(); // of the master itself: from now on it has PDOs
    }

    receive(frame) {
        if (frame.ext || frame.rtr || frame.err)
            return;
        this.device.receive(frame);
        this.listeners.get(frame.id)?.(frame.data);
    }

    /** Call `listener` with the data of each frame of a COB-ID, after the stack has taken it. */
    on(cobId, listener) {
        this.listeners.set(cobId, listener);
    }

    close() {
        this.device.stop();
        this.channel.stop();
    }
}

function channelOn(name) {
    try {
        return socketcan.createRawChannel(name);
    } catch (error) {
        throw new Trouble(`no CAN interface ${name}: ${error.message ?? error}`);
    }
}

module.exports = { Bus };

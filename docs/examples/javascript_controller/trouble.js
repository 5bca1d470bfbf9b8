// What goes wrong on machine or bus: a sentence for the person at the bench, and which node it was.
'use strict';

class Trouble extends Error {
    constructor(message, node = null, emcy = null) {
        super(message);
        this.node = node;
        this.emcy = emcy;
    }
}

module.exports = { Trouble };

// The page's connection: it asks, is answered or refused in words, and is told what it watches.
const waiting = new Map();
const hearers = new Set();
let socket = null;
let number = 0;
let watched = null;

export function connect(onState) {
  socket = new WebSocket(`${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/live`);
  socket.onopen = () => {
    onState(true);
    if (watched !== null) watch(watched);
  };
  socket.onmessage = (event) => {
    const told = JSON.parse(event.data);
    if ("view" in told) see(told);
    else settle(told);
  };
  socket.onclose = () => {
    onState(false);
    for (const { refuse } of waiting.values()) refuse(new Error("the panel has gone"));
    waiting.clear();
    setTimeout(() => connect(onState), 1000);
  };
}

// The panel tells more once this page has drawn what it was told.
function see(told) {
  try {
    for (const hear of hearers) hear(told);
  } finally {
    if (socket.readyState === WebSocket.OPEN) socket.send('{"ask": "seen"}');
  }
}

function settle(told) {
  const asked = waiting.get(told.id);
  waiting.delete(told.id);
  if (asked === undefined) return;
  if ("refused" in told) asked.refuse(new Error(told.refused));
  else asked.take(told.answer);
}

// The answer; rejects with the reason where it is refused.
export function ask(what, more = {}) {
  return new Promise((take, refuse) => {
    if (socket === null || socket.readyState !== WebSocket.OPEN) {
      refuse(new Error("the panel has gone"));
      return;
    }
    number += 1;
    waiting.set(number, { take, refuse });
    socket.send(JSON.stringify({ id: number, ask: what, ...more }));
  });
}

// What the panel packs for a curve: 32-bit numbers, null where there is none.
export function unpacked(text) {
  const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  return Array.from(new Float32Array(bytes.buffer), (value) => (Number.isNaN(value) ? null : value));
}

export function watch(view) {
  watched = view;
  ask("watch", { view }).catch(() => {});
}

export function hear(hearer) {
  hearers.add(hearer);
}

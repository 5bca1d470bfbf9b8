// Machine: its geoms in three dimensions, where the drives say that they are.
import { act } from "./app.js";
import { element, say, table } from "./elements.js";
import * as THREE from "./vendor/three/three.module.js";

const HEIGHT = 520;
const SHAPES = {
  box: ([x, y, z]) => new THREE.BoxGeometry(2 * x, 2 * y, 2 * z),
  sphere: ([radius]) => new THREE.SphereGeometry(radius, 32, 20),
  ellipsoid: ([x, y, z]) => new THREE.SphereGeometry(1, 32, 20).scale(x, y, z),
  cylinder: ([radius, half]) => new THREE.CylinderGeometry(radius, radius, 2 * half, 40).rotateX(Math.PI / 2),
  capsule: ([radius, half]) => new THREE.CapsuleGeometry(radius, 2 * half, 8, 24).rotateX(Math.PI / 2),
};

export function machine(place) {
  const said = element("p", { class: "soft", "data-is": "drawn" });
  const stage = element("div", { class: "stage" });
  const axes = element("div", { "data-is": "axes" });
  place.replaceChildren(element("section", {}, said, stage, element("p", { class: "soft" }, "Drag: turn it. Wheel: nearer or farther."), axes));
  const picture = machineOn(stage, HEIGHT);
  return {
    take(now) {
      if (now.geoms === null) {
        say(said, now.why);
        return;
      }
      picture.take(now.geoms);
      say(said, picture.why || `${now.machine}: ${now.geoms.length} geoms, where the drives say that they are${now.left_out > 0 ? `; ${now.left_out} of other shapes are left out` : ""}`);
      axes.replaceChildren(table(["axis", "position", "force or torque", "switches"], now.axes.map((axis) => [
        axis.name,
        axis.position === null ? "unknown" : `${axis.position.toFixed(4)} ${axis.unit}`,
        axis.torque === null ? "unknown" : `${axis.torque.toFixed(2)} ${axis.torque_unit}`,
        axis.switches === null ? "unknown" : axis.switches.join(", ") || "none active",
      ])));
    },
    close: picture.close,
  };
}

// The machine in three dimensions on `stage`, so many pixels high; `why` nothing is drawn where the browser cannot.
export function machineOn(stage, height) {
  const scene = new THREE.Scene();
  const camera = new THREE.PerspectiveCamera(40, 1, 0.01, 100);
  camera.up.set(0, 0, 1);
  const view = { around: -0.9, above: 0.5, far: 2.6, centre: new THREE.Vector3(0, 0, 0.5), own: false };
  const sun = new THREE.DirectionalLight(0xffffff, 2);
  sun.position.set(1, -2, 3);
  scene.add(sun, new THREE.HemisphereLight(0xffffff, 0x667788, 1.6));
  let renderer = null, parts = [], told = null, why = "";
  const seen = new THREE.Box3(); // all that the machine has reached since it is looked at
  try {
    renderer = new THREE.WebGLRenderer({ antialias: true, alpha: true });
    stage.append(renderer.domElement);
  } catch (error) {
    why = `This browser draws nothing in three dimensions: ${error.message}`;
  }
  turnable(stage, view, draw);

  function build(geoms) {
    for (const part of parts) scene.remove(part);
    parts = geoms.map((geom) => {
      const [red, green, blue, alpha] = geom.colour;
      const material = new THREE.MeshStandardMaterial({ color: new THREE.Color(red, green, blue), roughness: 0.6, transparent: alpha < 1, opacity: alpha });
      const part = new THREE.Mesh(geom.shape === "mesh" ? undefined : SHAPES[geom.shape](geom.size), material);
      part.matrixAutoUpdate = false;
      scene.add(part);
      return part;
    });
    for (const number of new Set(geoms.filter((geom) => geom.shape === "mesh").map((geom) => geom.mesh))) fetchMesh(number, geoms, parts);
  }

  // A mesh is asked for once, and is drawn by all geoms that have it.
  async function fetchMesh(number, geoms, built) {
    const told = await act("mesh", { mesh: number });
    if (told === undefined || built !== parts) return;
    const shape = meshGeometry(told);
    geoms.forEach((geom, at) => {
      if (geom.shape === "mesh" && geom.mesh === number) built[at].geometry = shape;
    });
    frame();
    draw();
  }

  function draw() {
    if (renderer === null || told === null || stage.clientWidth === 0) return;
    renderer.setSize(stage.clientWidth, height);
    camera.aspect = stage.clientWidth / height;
    camera.updateProjectionMatrix();
    const flat = view.far * Math.cos(view.above);
    camera.position.set(flat * Math.cos(view.around), flat * Math.sin(view.around), view.far * Math.sin(view.above)).add(view.centre);
    camera.lookAt(view.centre);
    renderer.render(scene, camera);
  }

  return {
    get why() { return why; },
    take(geoms) {
      told = geoms;
      if (parts.length !== geoms.length) build(geoms);
      geoms.forEach(({ place: [x, y, z], turned: [a, b, c, d, e, f, g, h, i] }, number) => {
        parts[number].matrix.set(a, b, c, x, d, e, f, y, g, h, i, z, 0, 0, 0, 1);
        parts[number].matrixWorldNeedsUpdate = true;
      });
      frame();
      draw();
    },
    close() {
      renderer?.dispose();
      renderer?.forceContextLoss(); // a browser keeps a few of them only
    },
  };

  // So far away that all of it stays in sight as it moves; whoever turns the wheel decides that himself.
  function frame() {
    scene.updateMatrixWorld(true);
    for (const part of parts) seen.expandByObject(part);
    if (view.own || seen.isEmpty()) return;
    seen.getCenter(view.centre);
    view.far = Math.max(0.4, 1.5 * seen.getSize(new THREE.Vector3()).length()); // half of it over the sine of half the angle of view
  }
}

// Faces are flat where they meet at an edge: every triangle has its own corners.
function meshGeometry({ vertices, triangles }) {
  const shape = new THREE.BufferGeometry();
  shape.setAttribute("position", new THREE.BufferAttribute(new Float32Array(bytes(vertices)), 3));
  shape.setIndex(new THREE.BufferAttribute(new Uint32Array(bytes(triangles)), 1));
  const flat = shape.toNonIndexed();
  flat.computeVertexNormals();
  return flat;
}

const bytes = (packed) => Uint8Array.from(atob(packed), (letter) => letter.charCodeAt(0)).buffer;

function turnable(stage, view, draw) {
  let held = null;
  stage.addEventListener("pointerdown", (event) => {
    held = [event.clientX, event.clientY];
    stage.setPointerCapture(event.pointerId);
  });
  stage.addEventListener("pointermove", (event) => {
    if (held === null) return;
    view.around -= 0.008 * (event.clientX - held[0]);
    view.above = Math.min(1.5, Math.max(-1.5, view.above + 0.008 * (event.clientY - held[1])));
    held = [event.clientX, event.clientY];
    draw();
  });
  stage.addEventListener("pointerup", () => { held = null; });
  stage.addEventListener("wheel", (event) => {
    event.preventDefault();
    view.own = true;
    view.far *= event.deltaY > 0 ? 1.1 : 1 / 1.1;
    draw();
  }, { passive: false });
}

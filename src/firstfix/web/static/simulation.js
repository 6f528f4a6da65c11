/** The controls of a simulated robot: world, sensor, plain AMCL, cover, people, pause. */

const byId = (id) => document.getElementById(id);

export class Simulation {
  #send;

  /** @param {(message: object) => boolean} send sends a command */
  constructor(send) {
    this.#send = send;
    byId("world").addEventListener("change", () => send({ type: "world", name: byId("world").value }));
    byId("sensor").addEventListener("change", () => send({ type: "sensor", name: byId("sensor").value }));
    byId("amcl").addEventListener("change", () => send({ type: "amcl", start: byId("amcl").value }));
    byId("cover").addEventListener("click", () => {
      send({ type: "cover", covered: byId("cover").getAttribute("aria-pressed") !== "true" });
    });
    byId("people").addEventListener("input", () => this.#showPeople());
    byId("people").addEventListener("change", () => this.#setPeople());
    byId("add-person").addEventListener("click", () => {
      byId("people").stepUp();
      this.#setPeople();
    });
  }

  /** Fill the menus, from `hello`; null for a real robot. */
  offer(menus) {
    byId("simulation").hidden = menus === null;
    if (menus === null) return;
    fill(byId("world"), menus.worlds);
    fill(byId("sensor"), menus.sensors);
  }

  /** Show a state: other viewers use the same controls. */
  show({ simulation, paused }) {
    byId("pause").setAttribute("aria-pressed", String(paused));
    byId("pause-text").textContent = paused ? "Resume" : "Pause";
    byId("pause-icon").setAttribute("href", paused ? "#i-play" : "#i-pause");
    if (!simulation) return;
    const { world, sensor, covered, amcl } = simulation;
    if (document.activeElement !== byId("amcl")) byId("amcl").value = amcl;
    if (document.activeElement !== byId("world")) byId("world").value = world;
    if (document.activeElement !== byId("sensor")) byId("sensor").value = sensor;
    byId("cover").setAttribute("aria-pressed", String(covered));
    byId("cover").textContent = covered ? "Uncover the sensor" : "Cover the sensor";
  }

  #showPeople() {
    byId("people-count").value = byId("people").value;
  }

  #setPeople() {
    this.#showPeople();
    this.#send({ type: "people", count: Number(byId("people").value) });
  }
}

function fill(select, names) {
  select.replaceChildren(...names.map((name) => new Option(name, name)));
}

/* The drive runs in the page: the compiled run-time as WebAssembly; native.c tells what its functions do. */
const OK = 0, FAILED = 1, MORE = 2; // codes of the run-time
const BREATH = 1000, PATIENCE = 40; // steps between two looks at the clock; ms until the page answers again

async function bytes(text) {
  const packed = new Blob([Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0))]);
  const stream = packed.stream().pipeThrough(new DecompressionStream("gzip"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

class Drive {
  constructor(library, file) {
    [this.c, this.places] = [library, {}];
    library._initialize();
    const why = this.room("message", PAGE.message_length);
    const model = library.native_open(this.put("file", file), file.length, why);
    this.handle = model === 0 ? 0 : library.native_new(model);
    if (this.handle === 0) throw new Error(model === 0 ? this.text(why) : "There is not enough memory.");
    this.run = this.room("run", PAGE.layout.size);
  }

  /* Returns the address of room that is kept by a name, and grows. */
  room(name, size) {
    this.places[name] = this.c.realloc(this.places[name] ?? 0, Math.max(size, 8));
    if (this.places[name] === 0) throw new Error("There is not enough memory.");
    return this.places[name];
  }

  put(name, numbers) {
    const place = this.room(name, numbers.byteLength);
    new numbers.constructor(this.c.memory.buffer, place, numbers.length).set(numbers);
    return place;
  }

  text(place) {
    const found = new Uint8Array(this.c.memory.buffer, place, PAGE.message_length);
    return new TextDecoder().decode(found.slice(0, found.indexOf(0)));
  }

  field(name, value) {
    const view = new DataView(this.c.memory.buffer, this.run), place = PAGE.layout[name];
    if (value !== undefined) view.setInt32(place, value, true);
    return view.getInt32(place, true);
  }

  /* Runs with [reference, SI value] pairs. Returns what was written, with a message where it could not go on, or null
   * where it is no longer wanted. */
  async simulate(values, references, until, wanted) {
    const widths = { points: { times: 1, outputs: references.length }, events: { events: 7 } };
    const rooms = { points: PAGE.points + 64, events: 64 };
    new Uint8Array(this.c.memory.buffer, this.run, PAGE.layout.size).fill(0);
    const fields = { n_outputs: references.length, steps: BREATH };
    fields.references = this.put("references", Uint32Array.from(references));
    for (const name in fields) this.field(name, fields[name]);
    this.make(widths, rooms);
    let code = this.begin(values, until), message = "", clock = performance.now();
    for (let go = code === OK; go; go = code === MORE && message === "") {
      code = this.c.native_run(this.handle, until, BigInt(PAGE.points), this.run);
      if (this.field("n_events") > PAGE.most_events) message = `There were more than ${PAGE.most_events} events.`;
      if (code !== MORE) break;
      for (const counted in rooms) if (2 * this.field(`n_${counted}`) >= rooms[counted]) rooms[counted] *= 2;
      this.make(widths, rooms);
      if (performance.now() - clock < PATIENCE) continue;
      await new Promise((later) => setTimeout(later));
      if (!wanted()) return null;
      clock = performance.now();
    }
    if (code === FAILED) message = this.text(this.c.native_message(this.handle));
    return this.written(widths, rooms, references, message);
  }

  make(widths, rooms) {
    for (const [counted, arrays] of Object.entries(widths)) {
      this.field(`room_${counted}`, rooms[counted]);
      for (const name in arrays) this.field(name, this.room(name, 8 * arrays[name] * rooms[counted]));
    }
  }

  begin(values, until) {
    const c = this.c, references = this.put("set", Uint32Array.from(values, (pair) => pair[0]));
    const numbers = this.put("numbers", Float64Array.from(values, (pair) => pair[1]));
    return c.native_reset(this.handle, 0, until, PAGE.rtol, PAGE.atol) ||
      c.native_set(this.handle, BigInt(values.length), references, numbers) || c.native_begin(this.handle);
  }

  written(widths, rooms, references, message) {
    const counts = this.room("counts", 32), found = { message, references };
    const read = (place, size) => new Float64Array(this.c.memory.buffer, place, size).slice();
    for (const [counted, arrays] of Object.entries(widths))
      for (const name in arrays)
        found[name] = read(this.places[name], arrays[name] * Math.min(this.field(`n_${counted}`), rooms[counted]));
    this.c.native_counts(this.handle, counts);
    return Object.assign(found, { steps: read(counts, 1)[0] });
  }
}

/* What runs the drive: this is asked for once. */
async function openDrive() {
  const { instance } = await WebAssembly.instantiate(await bytes(PAGE.runtime), {});
  return new Drive(instance.exports, await bytes(PAGE.model));
}

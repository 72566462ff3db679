// Reads the numbers that the page carries as base64 text: 32-bit floats, or 16-bit steps between low and high.
const decode = (part) => {
  const bytes = Uint8Array.from(atob(part.data), (letter) => letter.charCodeAt(0));
  if (part.type === "f4") return new Float32Array(bytes.buffer);
  const steps = new Uint16Array(bytes.buffer);
  return Float64Array.from(steps, (step) => part.low + part.step * step);
};

const make = (name, attributes = {}, ...children) => {
  const node = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) node.setAttribute(key, value);
  node.append(...children);
  return node;
};

// Names come from scenarios: always text, never markup, and isolated from the direction of what stands around them.
const isolated = (text) => make("bdi", {}, String(text));

// The name of a key, which may be broken after its dots and underscores.
const breakable = (text) => make("bdi", {}, ...String(text).split(/(?<=[._])/).flatMap((part) => [part, make("wbr")]));

const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();

const shown = (value, digits = 2) =>
  value === null || !Number.isFinite(value) ? "–" : (Math.abs(value) < 0.5 * 10 ** -digits ? 0 : value).toFixed(digits).replace("-", "−");

const brief = (value) => (typeof value === "number" ? String(Number(value.toPrecision(6))).replace("-", "−") : String(value ?? "–"));

// Calls back when colours change: dark or light, and before and after printing.
const onTheme = (redraw) => {
  for (const query of ["(prefers-color-scheme: dark)", "print"]) matchMedia(query).addEventListener("change", redraw);
};

// The largest of 1, 2, 5, 10, 20 ... that is not larger than a length.
const roundBelow = (length) => {
  const power = 10 ** Math.floor(Math.log10(length));
  return [5, 2, 1].find((part) => part * power <= length) * power;
};

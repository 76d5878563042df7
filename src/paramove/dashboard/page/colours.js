// Colours of objects by their names; a name that is not known gets a hue of its own. Values are never taken from messages.
const KNOWN = {
  yellow: [0.93, 0.76, 0.08], green: [0.13, 0.65, 0.25], blue: [0.2, 0.36, 0.9], red: [0.85, 0.18, 0.16],
  orange: [0.93, 0.5, 0.1], purple: [0.55, 0.27, 0.8], white: [0.95, 0.95, 0.95], black: [0.12, 0.12, 0.12],
};

export function colourOf(name) {
  if (Object.hasOwn(KNOWN, name)) return KNOWN[name];
  let hash = 7;
  for (const letter of String(name)) hash = (hash * 31 + letter.codePointAt(0)) % 360;
  const channel = (n) => { const k = (n + hash / 30) % 12; return 0.5 - 0.35 * Math.max(-1, Math.min(k - 3, 9 - k, 1)); };
  return [channel(0), channel(8), channel(4)];
}

export function css(colour, alpha = 1) {
  return `rgb(${colour.map((part) => Math.round(255 * part)).join(" ")} / ${alpha})`;
}

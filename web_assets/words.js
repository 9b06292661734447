// The words of the page in the language of the console, from the table that the page carries.

const { language, table } = JSON.parse(document.getElementById("table-of-words").textContent);

export const LANGUAGE = language;

export const has = (key) => Object.hasOwn(table, key);

export function say(key, values = {}) {
  if (!has(key)) throw new Error(`no words for ${key}`);
  return table[key].replace(/\{(\w+)\}/g, (_, name) => String(values[name]));
}

// What people call a label, and a type of room; a text that is neither as it came. Messages have the
// labels, which are English.
export const nameOf = (label) => called("name", label, ["", "s", "es"]);
export const roomOf = (name) => called("room_type", name, [""]);

function called(kind, text, plurals) {
  const label = text.trim().toLowerCase().replaceAll(/[\s_-]+/g, "_");
  const keys = plurals.filter((end) => label.endsWith(end))
    .map((end) => `${kind}.${label.slice(0, label.length - end.length)}`);
  const known = keys.find(has);
  return known === undefined ? text.replaceAll("_", " ") : table[known];
}

// The text for one or for several.
export const sayCount = (key, n, values = {}) => say(`${key}.${n === 1 ? "one" : "other"}`, { n, ...values });

export function decimal(value, digits) {
  return value.toLocaleString(LANGUAGE, {
    minimumFractionDigits: digits, maximumFractionDigits: digits, useGrouping: false,
  });
}

export const percent = (share) => say("number.percent", { n: Math.round(100 * share) });

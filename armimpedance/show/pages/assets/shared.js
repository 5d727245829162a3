// What the scripts of all pages share: the page's data, and files to save.
const read = (id) => JSON.parse(document.getElementById(id).textContent);
const data = read("data");

/** The values of a column: as they stand, texts that come again, or coded numbers. */
function decoded(column) {
  if (Array.isArray(column)) return column;
  if (column.texts) return column.of.map((i) => column.texts[i]);
  const bytes = Uint8Array.from(atob(column.int16), (c) => c.charCodeAt(0));
  return Array.from(new Int16Array(bytes.buffer), (i) => Number((i * column.step).toPrecision(6)));
}

/** The rows of one of the page's tables. */
function rows(name) {
  const columns = Object.entries(data[name]).map(([key, column]) => [key, decoded(column)]);
  const length = columns.length ? columns[0][1].length : 0;
  return Array.from({ length }, (_, i) =>
    Object.fromEntries(columns.map(([key, values]) => [key, values[i]])));
}

function say(text) { document.getElementById("said").textContent = text; }

/** Hand a file to the reader. */
function save(name, text, type) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(new Blob([text], { type }));
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
  say(`${name} is saved`);
}

/** One of the page's tables as CSV; a text that a spreadsheet would run gets an apostrophe. */
function csv(name) {
  const cell = (value) => {
    const text = value === null ? "" : String(value);
    const safe = typeof value === "string" && /^[=+\-@\t\r]/.test(text) ? `'${text}` : text;
    return /[",\n\r]/.test(safe) ? `"${safe.replaceAll('"', '""')}"` : safe;
  };
  const columns = Object.keys(data[name]);
  const lines = rows(name).map((row) => columns.map((key) => cell(row[key])).join(","));
  return [columns.map(cell).join(","), ...lines, ""].join("\n");
}


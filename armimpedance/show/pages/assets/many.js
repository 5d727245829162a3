// Which sessions of the table of marks are shown.
const lines = [...document.querySelectorAll("#heat tbody tr")]
  .map((row) => ({ row, text: row.textContent.toLowerCase() }));
const find = document.getElementById("find");
const state = document.getElementById("show");
function narrow() {
  const words = find.value.toLowerCase();
  let count = 0;
  for (const { row, text } of lines) {
    row.hidden = !text.includes(words) || (state.value !== "" && row.dataset.state !== state.value);
    count += !row.hidden;
  }
  document.getElementById("shown").textContent = `${count} of ${lines.length} sessions`;
}
find.addEventListener("input", narrow);
state.addEventListener("change", narrow);
narrow();

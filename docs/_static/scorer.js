// Ranks of the site's search: Sphinx's own numbers, and a how-to page or a tutorial before a page that
// only names the word.
const SHELVES = { how_to: 12, tutorials: 8, explanation: 4, reference: 2 };

var Scorer = {
  score: ([page, , , , score]) =>
    page.startsWith("reference/api/rooms") ? score - 10 : score + (SHELVES[page.split("/")[0]] || 0),
  objNameMatch: 11,
  objPartialMatch: 6,
  objPrio: { 0: 15, 1: 5, 2: -5 },
  objPrioDefault: 0,
  title: 15,
  partialTitle: 7,
  term: 5,
  partialTerm: 2,
};

// Ranks of the site's search: Sphinx's own numbers; a how-to page or a tutorial before a page that
// only names the word; a title that holds all words before one that holds some, and the shorter one
// of two; lists of pages last.
const SHELVES = { how_to: 12, tutorials: 8, explanation: 4, reference: 2 };
const A_WORD_IN_THE_TITLE = 6;
const A_LETTER_OF_THE_TITLE = 0.02;
const A_LIST_OF_PAGES = -20;
const A_ROOM = -10;

const stems = () =>
  (new URLSearchParams(window.location.search).get("q") || "")
    .toLowerCase()
    .split(/\s+/)
    .map((word) => word.replace(/s$/, ""))
    .filter((stem) => stem.length > 1);

var Scorer = {
  score: ([page, title, , , score]) => {
    if (page.startsWith("reference/api/")) return score + (page.includes("/rooms") ? A_ROOM : 0);
    const inTitle = stems().filter((stem) => title.toLowerCase().includes(stem)).length;
    return (
      score +
      A_WORD_IN_THE_TITLE * inTitle +
      (SHELVES[page.split("/")[0]] || 0) +
      (page.endsWith("/index") ? A_LIST_OF_PAGES : 0) -
      A_LETTER_OF_THE_TITLE * title.length
    );
  },
  objNameMatch: 11,
  objPartialMatch: 6,
  objPrio: { 0: 15, 1: 5, 2: -5 },
  objPrioDefault: 0,
  title: 15,
  partialTitle: 7,
  term: 5,
  partialTerm: 2,
};

// Scores of the site's search: Sphinx's own, with pages for readers before the reference of functions.
var Scorer = {
  score: ([docname, , , , score, , kind]) => {
    if (docname.startsWith("reference/api")) return score - 4;
    return docname === "reference/glossary" && kind !== "text" ? score + 10 : score;
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

// Scores of the site's search: Sphinx's own, and pages that explain before pages that list.
var PAGES = [
  [/^reference\/glossary$/, 6], [/^how-to\/messages$/, 0], [/^(how-to|explanation)\//, 4], [/^tutorials\//, 2], [/^reference\/(citing|problems|methods)$/, 2],
  [/^(reference|index|results)/, -4], [/^changelog$/, -12],
];
var Scorer = {
  score: ([docname, , , , score, , kind]) => {
    if (docname === "reference/glossary" && kind === "index") return -100; // its terms are hits of their own
    return score + (PAGES.find(([name]) => name.test(docname)) || [0, 0])[1];
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

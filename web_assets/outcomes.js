// What became of the goals of a session: in the list of sessions and beside another session.

import { has, nameOf, say } from "/assets/words.js";

export const outcomeOf = (word) => (has(`outcome.${word}`) ? say(`outcome.${word}`) : word);

const isFound = (goal) => goal.outcome === "found" || goal.outcome === "out_of_reach";

// Its objects, contexts and outcome as texts, and the word of the outcome that they share.
export function sumOf(goals) {
  const words = [...new Set(goals.map((goal) => goal.outcome))];
  const n = goals.filter(isFound).length;
  return {
    objects: goals.map((goal) => nameOf(goal.object)).join(", "),
    context: [...new Set(goals.map((goal) => goal.context).filter(Boolean))].join("; "),
    outcome: words.length > 1 ? say("outcome.several", { n, all: goals.length }) : words.map(outcomeOf).join(""),
    word: words.length > 1 ? "several" : (words[0] ?? ""),
  };
}

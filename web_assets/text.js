// Sets texts of the page.

// Leaves a text as it is that stays the same: screen readers read a live region again whenever it is
// written, and the page writes all of it several times per second.
export function setText(node, text) {
  if (node.textContent !== text) node.textContent = text;
}

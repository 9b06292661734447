// The path of this robot's page: "/" for the console's own robot.

export const BASE = document.getElementById("view").getAttribute("src").split("view/")[0];

// Light or dark: what was chosen on a page of this console, or the system's setting.

const THEME = "ippon-theme";
export const light = matchMedia("(prefers-color-scheme: light)");

export const chosenTheme = () => localStorage.getItem(THEME) ?? (light.matches ? "light" : "dark");

export const chooseTheme = (theme) => localStorage.setItem(THEME, theme);

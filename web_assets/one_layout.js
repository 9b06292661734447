// A phone gets the docked panel too, which view.css puts below the map: viser's own layout for
// narrow screens is a sheet that covers the map. Its client asks for the width with matchMedia.

const ask = globalThis.matchMedia.bind(globalThis);
globalThis.matchMedia = (query) => ask(/^\(max-width: [\d.]+em\)$/.test(query) ? "not all" : query);

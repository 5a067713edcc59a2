// Colours, in light, dark and print.
const dark = window.matchMedia("(prefers-color-scheme: dark)");
let printing = false;
const listeners = [];

export const isDark = () => dark.matches && !printing;
export const onTheme = (redraw) => listeners.push(redraw);
const changed = () => listeners.forEach((redraw) => redraw());
dark.addEventListener("change", changed);
for (const [event, state] of [["beforeprint", true], ["afterprint", false]]) {
  window.addEventListener(event, () => {
    printing = state;
    changed();
  });
}

export const text = () => (isDark() ? "#d8d8d8" : "#222");
export const faint = () => (isDark() ? "#9a9a9a" : "#666");
export const grid = () => (isDark() ? "#3a3a3a" : "#e2e2e2");
export const paper = () => (isDark() ? "#1b1b1d" : "#fff");

// Of lines, told apart also by those who see fewer colours (after Okabe and Ito).
const LINES = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#8c6bb1", "#7f7f7f"];
const BRIGHT = ["#4aa8e0", "#f08a3c", "#2fc79b", "#e39cc5", "#f0b93a", "#8fd0f5", "#b397d6", "#aaaaaa"];
export const line = (number) => (isDark() ? BRIGHT : LINES)[number % LINES.length];

const VIRIDIS = ["#440154", "#482878", "#3e4a89", "#31688e", "#26828e", "#1f9e89", "#35b779", "#6ece58", "#b5de2b", "#fde725"];
const DIVERGING = ["#2166ac", "#67a9cf", "#d1e5f0", "#f7f7f7", "#fddbc7", "#ef8a62", "#b2182b"];
const channels = (hex) => [1, 3, 5].map((at) => parseInt(hex.slice(at, at + 2), 16));

function mixed(stops, x) {
  const place = Math.min(Math.max(x, 0), 1) * (stops.length - 1);
  const index = Math.min(Math.floor(place), stops.length - 2);
  const [low, high] = [channels(stops[index]), channels(stops[index + 1])];
  return low.map((value, i) => value + (high[i] - value) * (place - index));
}

// The colour of one of several drive levels: neither too pale on white nor too dark on black.
export function level(number, count) {
  const [first, last] = isDark() ? [0.35, 1] : [0, 0.85];
  const x = count > 1 ? first + ((last - first) * number) / (count - 1) : isDark() ? 0.65 : 0.3;
  return `rgb(${mixed(VIRIDIS, x).map(Math.round).join(",")})`;
}

// Red, green and blue (0 ... 1) of a deflection from -1 to 1.
export const diverging = (x) => mixed(DIVERGING, (x + 1) / 2).map((value) => value / 255);
export const divergingGradient = `linear-gradient(90deg, ${DIVERGING.join(",")})`;

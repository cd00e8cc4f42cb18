// Starts what the page has: the theme, the motions, the charts.

/** The motions of all runs that have one, and a player for them. */
async function startPlayer(data) {
  const canvases = [...document.querySelectorAll("#player canvas")];
  if (!canvases.length) return null;
  const stages = await Promise.all(canvases.map(async (canvas) => {
    const run = Number(canvas.dataset.run);
    const text = document.getElementById(`motion-${run}`).textContent;
    return new Stage(canvas, await unpack(data[run].motion, text));
  }));
  const of = (id) => document.getElementById(id);
  return new Player(stages, {
    root: of("player"), play: of("play"), scrub: of("scrub"), clock: of("clock"), field: of("field"),
    rate: of("rate"), bar: of("bar"), hint: of("hint"),
  });
}

const CHARTS = {
  energy: ({ energy }) => ({
    title: "Energy per metre of thickness", unit: "J/m", kind: "stack", time: energy.time, series: energy.parts,
    expected: energy.expected, expectedLabel: "Start and work put in",
  }),
  shares: ({ steps }) => ({
    title: "Share of the steps", unit: "%", kind: "stack", time: steps.time, range: [0, 100], alwaysLegend: true, height: 200,
    series: steps.shares,
  }),
  step: ({ steps }) => {
    const [low, high] = [Math.min(...steps.step), Math.max(...steps.step)];
    return {
      title: "Mean step", unit: "s", kind: "line", time: steps.time, log: low > 0 && high > 20 * low, height: 190,
      series: [{ label: "Mean step", values: steps.step, colour: 0 }],
    };
  },
};

function startCharts(data, seek) {
  for (const host of document.querySelectorAll("[data-chart]")) {
    chart(host, CHARTS[host.dataset.chart](data[host.dataset.run].charts), seek);
  }
  for (const host of document.querySelectorAll("[data-history]")) {
    for (const curve of data[host.dataset.history].charts.history) {
      const [card, cell] = [document.createElement("div"), document.createElement("div")];
      card.className = "card";
      cell.className = "chart";
      card.append(cell);
      host.append(card);
      const series = [{ label: curve.label, values: curve.values, colour: 0 }];
      chart(cell, { title: curve.label, unit: curve.unit, kind: "line", time: curve.time, height: 170, series }, seek);
    }
  }
}

/** Light or dark: what the reader's system says until the button is used. */
function startTheme(redraw) {
  const button = document.getElementById("theme");
  const system = matchMedia("(prefers-color-scheme: dark)");
  const root = document.documentElement;
  const isDark = () => (root.dataset.theme ? root.dataset.theme === "dark" : system.matches);
  const show = () => {
    button.textContent = isDark() ? "Light" : "Dark";
    button.setAttribute("aria-label", `Switch to ${isDark() ? "light" : "dark"} colours`);
    redraw();
  };
  button.addEventListener("click", () => {
    root.dataset.theme = isDark() ? "light" : "dark";
    show();
  });
  system.addEventListener("change", show);
  startPrint(root, show);
  show();
}

/** Paper is light, and nobody can open on it what is closed. */
function startPrint(root, show) {
  let before = null;
  addEventListener("beforeprint", () => {
    const closed = [...document.querySelectorAll("details:not([open])")];
    before = { theme: root.dataset.theme, closed };
    root.dataset.theme = "light";
    for (const one of closed) one.open = true;
    show();
  });
  addEventListener("afterprint", () => {
    if (!before) return;
    if (before.theme) root.dataset.theme = before.theme;
    else delete root.dataset.theme;
    for (const one of before.closed) one.open = false;
    before = null;
    show();
  });
}

/** Starts what the page shows at present; what it showed before is put away. */
async function start() {
  window.tandem?.player?.end();
  CURSORS.clear();
  const data = JSON.parse(document.getElementById("data").textContent);
  const player = await startPlayer(data);
  startCharts(data, player && ((time) => player.seek(time)));
  player?.listeners.push(showCursors);
  if (player) showCursors(player.time);
  // For whoever looks into the page from outside: what is there, and that it is ready.
  window.tandem = { data, player, ready: performance.now() };
  document.documentElement.dataset.ready = "yes";
}

startTheme(() => window.tandem?.player?.draw());
await start();

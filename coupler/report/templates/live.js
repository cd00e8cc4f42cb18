
// The page of a run that goes on loads itself again now and then, and keeps what its reader has chosen.

/** What the reader has chosen. */
function choices() {
  const { player } = window.tandem;
  return {
    closed: [...document.querySelectorAll("details")].map((one) => one.open),
    theme: document.documentElement.dataset.theme,
    field: player?.elements.field.value,
    rate: player?.elements.rate.value,
    // Who looks at the last frame follows the run.
    time: player && player.place < player.times.length - 1 ? player.time : null,
    scroll: [scrollX, scrollY],
  };
}

function choose({ closed, theme, field, rate, time, scroll }) {
  document.querySelectorAll("details").forEach((one, k) => { one.open = closed[k] ?? one.open; });
  if (theme && theme !== document.documentElement.dataset.theme) document.getElementById("theme").click();
  const { player } = window.tandem;
  if (player) {
    if (player.fields.some((one) => one.name === field)) player.elements.field.value = field;
    if (rate) player.elements.rate.value = rate;
    player.showField();
    if (time === null) player.show(player.times.length - 1);
    else player.seek(time);
  }
  scrollTo(...scroll);
}

/** Nobody who plays the motion or looks at something else is disturbed. */
function again() {
  if (document.hidden || window.tandem.player?.playing) {
    setTimeout(again, 1000);
  } else {
    history.replaceState(choices(), "");
    location.reload();
  }
}

const seconds = Number(document.documentElement.dataset.again);
if (history.state) choose(history.state);
else if (seconds) window.tandem.player?.show(window.tandem.player.times.length - 1);
if (seconds) setTimeout(again, 1000 * seconds);

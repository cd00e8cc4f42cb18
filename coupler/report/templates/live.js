
// Follows a run that goes on: when it has written something, the page is fetched again and what has changed is put in place.

/** What the reader has chosen, so that it stays when the page is renewed. */
function choices() {
  const { player } = window.tandem;
  return {
    closed: [...document.querySelectorAll("details")].map((one) => one.open),
    field: player?.elements.field.value,
    rate: player?.elements.rate.value,
    playing: Boolean(player?.playing),
    // Who looks at the last frame follows the run.
    time: player && player.place < player.times.length - 1 ? player.time : Infinity,
  };
}

function choose({ closed, field, rate, playing, time }) {
  document.querySelectorAll("details").forEach((one, k) => { one.open = closed[k] ?? one.open; });
  const { player } = window.tandem;
  if (!player) return;
  if (player.fields.some((one) => one.name === field)) player.elements.field.value = field;
  if (rate) player.elements.rate.value = rate;
  player.showField();
  if (time === Infinity) player.show(player.times.length - 1);
  else player.seek(time);
  if (playing && time !== Infinity) player.play();
}

/** Puts the page as it is now in the place of what is shown. */
async function renew() {
  const answer = await fetch(location.href, { cache: "no-store" });
  if (!answer.ok) return;
  const fresh = new DOMParser().parseFromString(await answer.text(), "text/html");
  if (!fresh.getElementById("data")) return;
  const chosen = choices();
  const [left, top] = [scrollX, scrollY];
  document.title = fresh.title;
  document.getElementById("main").replaceWith(fresh.getElementById("main"));
  for (const old of document.querySelectorAll("script[type='text/plain'], #data")) old.remove();
  document.body.append(...fresh.querySelectorAll("script[type='text/plain'], #data"));
  await start();
  choose(chosen);
  scrollTo(left, top);
}

const news = new EventSource(`events${location.search}`);
let renewing = null;
let again = false;
let over = false;

/** One renewal at a time, and twice as long between two as one takes, so that a large page leaves the run its processors. */
async function heard() {
  // The server ends with the run: after its last page there is nobody to ask.
  if (over) return;
  if (renewing) {
    again = true;
    return;
  }
  const begun = performance.now();
  renewing = renew();
  await renewing.catch(() => {});
  await new Promise((done) => { setTimeout(done, Math.max(1000, 2 * (performance.now() - begun))); });
  renewing = null;
  if (again) {
    again = false;
    heard();
  }
}

news.addEventListener("state", heard);
news.addEventListener("end", async () => {
  over = true;
  news.close();
  await renewing?.catch(() => {});
  await renew().catch(() => {});
  document.documentElement.dataset.live = "ended";
});
document.documentElement.dataset.live = "yes";
if (window.tandem.player) window.tandem.player.show(window.tandem.player.times.length - 1);

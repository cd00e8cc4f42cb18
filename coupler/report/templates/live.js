
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

/** What the server says of the run when that has gone on, or after some seconds: a number that grows with it. */
async function newsAfter(after) {
  const answer = await fetch(`news${location.search}&after=${after}`, { cache: "no-store" });
  return answer.json();
}

/** Renews the page until the run has ended. The server bounds how often that is. */
async function follow() {
  let news = { state: 0, ended: false };
  while (!news.ended) {
    const last = news.state;
    news = await newsAfter(last).catch(() => news);
    if (news.state !== last) await renew().catch(() => {});
    else await new Promise((done) => { setTimeout(done, 1000); });
  }
  document.documentElement.dataset.live = "ended";
}

document.documentElement.dataset.live = "yes";
if (window.tandem.player) window.tandem.player.show(window.tandem.player.times.length - 1);
follow();

// Dynamic sets: which time step is shown, and how it is played.

const kUntimedPerSecond = 24;  // as `dtr render` makes videos

/** Seconds that each time step is shown: until the next one, the last as long as the others on average. */
export function stepSeconds(times) {
  const gaps = times.slice(1).map((time, i) => time - times[i]);
  if (gaps.length === 0 || gaps.some((gap) => !(gap > 0))) return times.map(() => 1 / kUntimedPerSecond);
  return [...gaps, (times.at(-1) - times[0]) / gaps.length];
}

/** The slider and the button of the page. `changed(step)`: another time step is wanted. */
export class TimeControl {
  constructor(times, slider, button, changed) {
    Object.assign(this, { slider, button, changed, step: 0, playing: false, seconds: 0, shown: stepSeconds(times) });
    slider.hidden = button.hidden = times.length < 2;
    slider.max = String(times.length - 1);
    slider.addEventListener("input", () => this.goTo(Number(slider.value)));
  }

  goTo(step) {
    this.step = (step + this.shown.length) % this.shown.length;
    this.seconds = 0;
    this.slider.value = String(this.step);
    this.changed(this.step);
  }

  toggle() {
    if (this.shown.length < 2) return;
    this.playing = !this.playing;
    this.button.setAttribute("aria-pressed", String(this.playing));
  }

  /** Plays on by some seconds; not past a time step that is not drawn yet. */
  play(seconds, drawn) {
    if (!this.playing || !drawn) return;
    this.seconds += seconds;
    if (this.seconds < this.shown[this.step]) return;
    const over = Math.min(this.seconds - this.shown[this.step], this.shown[this.step]);
    this.goTo(this.step + 1);
    this.seconds = over;
  }
}

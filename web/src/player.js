// Plays the samples of a motion one after another.

export class Player {
  constructor(button, step) {
    Object.assign(this, { button, step, timer: null });
    button.addEventListener("click", () => (this.timer ? this.stop() : this.play()));
  }

  // `step(start)` shows the next sample and tells whether there is one more.
  play() {
    const count = this.step(true);
    this.say("Pause", true);
    const wait = Math.min(300, Math.max(40, 4000 / count));
    this.timer = setInterval(() => { if (!this.step(false)) this.stop(); }, wait);
  }

  stop() {
    clearInterval(this.timer);
    this.timer = null;
    this.say("Play", false);
  }

  say(word, on) {
    this.button.textContent = word;
    this.button.setAttribute("aria-pressed", String(on));
  }
}

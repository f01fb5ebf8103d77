// Time of the picture. A sound, if there is one, leads, whoever started, stopped or moved it.
export class Clock {
  constructor(duration, { loop = true, sound = null, onchange = () => {} } = {}) {
    Object.assign(this, { duration, loop, sound, onchange, time: 0, speed: 1, playing: false });
    if (sound) this.listen(sound);
  }

  listen(sound) {
    const on = (name, change) => sound.addEventListener(name, () => { change(); this.onchange(); });
    const here = () => { this.time = Math.min(sound.currentTime, this.duration); };
    on("play", () => { this.playing = true; });
    // a sound that comes to its end is paused first, and may begin again
    on("pause", () => { if (!sound.ended) { this.playing = false; here(); } });
    on("seeking", here);
    on("ratechange", () => { this.speed = sound.playbackRate; });
    on("ended", () => this.finish());
  }

  play() {
    if (!this.loop && this.time >= this.duration) this.seek(0);
    this.playing = true;
    if (this.sound) {
      this.sound.playbackRate = this.speed;
      this.sound.play().catch(() => { this.playing = false; });
    }
  }

  pause() {
    this.playing = false;
    if (!this.sound) return;
    this.sound.pause();
    // a sound runs on for a moment: it goes on from where the picture stands
    this.sound.currentTime = this.time;
  }

  seek(time) {
    this.time = Math.min(Math.max(time, 0), this.duration);
    if (this.sound) this.sound.currentTime = this.time;
  }

  setSpeed(speed) {
    this.speed = speed;
    if (this.sound) this.sound.playbackRate = speed;
  }

  finish() {
    if (this.loop && this.playing) { this.seek(0); this.play(); } else this.playing = false;
  }

  // `passed` s went by on the wall.
  advance(passed) {
    if (!this.playing) return;
    if (this.sound) { this.time = Math.min(this.sound.currentTime, this.duration); return; }
    this.time += passed * this.speed;
    if (this.time < this.duration) return;
    if (this.loop && this.duration > 0) this.time %= this.duration;
    else { this.time = this.duration; this.playing = false; }
  }
}

// Gravity by tilting a phone: down in the hand is down in the picture.
import * as THREE from 'three';

const kLeastChange = 0.02; // of gravity's size: less is the hand's trembling

export class TiltedGravity {
  /// Whether this looks like a device that is tilted.
  static is_there() { return 'DeviceOrientationEvent' in window && matchMedia('(pointer: coarse)').matches; }

  /// gravity: m/s^2, in the world's axes. live: the scene, which knows how the picture's axes lie.
  constructor(gravity, camera, live) {
    Object.assign(this, { own: gravity.clone(), camera, live, told: gravity.clone(), wanted: gravity.clone(), is_on: false });
    this.listener = (event) => this.feel(event);
  }

  /// Where the device wants to be asked it is asked: from a click alone. Returns whether gravity follows the device.
  async toggle() {
    if (this.is_on) {
      removeEventListener('deviceorientation', this.listener);
      this.wanted.copy(this.own);
      return (this.is_on = false);
    }
    const answer = await globalThis.DeviceOrientationEvent?.requestPermission?.().catch(() => 'denied');
    this.was_refused = answer === 'denied';
    if (this.was_refused) return false;
    this.rest = undefined;
    addEventListener('deviceorientation', this.listener);
    return (this.is_on = true);
  }

  /// beta, gamma: degrees about the device's x and y; its z looks out of the screen.
  feel({ beta, gamma }) {
    if (beta === null || gamma === null) return;
    const b = THREE.MathUtils.degToRad(beta), g = THREE.MathUtils.degToRad(gamma);
    const angle = THREE.MathUtils.degToRad(screen.orientation?.angle ?? 0);
    const down = new THREE.Vector3(Math.cos(b) * Math.sin(g), -Math.sin(b), -Math.cos(b) * Math.cos(g));
    down.applyAxisAngle(new THREE.Vector3(0, 0, 1), -angle).applyQuaternion(this.camera.quaternion);
    // As the device is held when it begins, gravity is the world's own.
    this.rest ??= new THREE.Quaternion().setFromUnitVectors(down.clone().normalize(), this.own_in_picture());
    this.wanted.copy(this.live.direction_to_world(down.applyQuaternion(this.rest))).setLength(this.size);
  }
  own_in_picture() {
    const own = this.own.length() > 0 ? this.own.clone() : this.live.direction_to_world(new THREE.Vector3(0, -1, 0));
    return own.applyQuaternion(this.live.scene.quaternion).normalize();
  }
  get size() { return this.own.length() || 9.81; }

  /// The gravity that the simulation has not heard of yet; null: it knows it.
  changed() {
    if (this.wanted.distanceTo(this.told) <= (this.is_on ? kLeastChange * this.size : 0)) return null;
    this.told.copy(this.wanted);
    return this.told.toArray();
  }
}

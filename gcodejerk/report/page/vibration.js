// Columns into numbers, and the motion of one mode under a profile: exact, piece by piece.
//
// Rule: mm, s and rad inside; a shown unit is chosen where something is shown.

const TYPES = { u1: Uint8Array, u2: Uint16Array, i4: Int32Array, f4: Float32Array, f8: Float64Array };

function unpack(column) {
  const raw = atob(column.data);
  const bytes = new Uint8Array(raw.length);
  for (let i = 0; i < raw.length; i++) bytes[i] = raw.charCodeAt(i);
  return new TYPES[column.type](bytes.buffer);
}

// The pieces of one profile: begin, duration, acceleration at the begin, jerk; of a way of 1.
function piecesOf(profiles, index) {
  const pieces = [];
  let begin = 0;
  for (let k = profiles.first[index]; k < profiles.first[index + 1]; k++) {
    const duration = profiles.duration[k];
    pieces.push({ begin, duration, acceleration: profiles.acceleration[k], jerk: profiles.jerk[k] });
    begin += duration;
  }
  return pieces;
}

function totalOf(pieces) {
  const last = pieces[pieces.length - 1];
  return last.begin + last.duration;
}

// z' = lambda z + a(t) from z over a time h, with a = acceleration + jerk t; lambda = decay + j omega.
function advance(z, decay, omega, acceleration, jerk, h) {
  const size = Math.exp(decay * h), er = size * Math.cos(omega * h), ei = size * Math.sin(omega * h);
  const norm = decay * decay + omega * omega;
  const fr = ((er - 1) * decay + ei * omega) / norm, fi = (ei * decay - (er - 1) * omega) / norm;
  const gr = ((fr - h) * decay + fi * omega) / norm, gi = (fi * decay - (fr - h) * omega) / norm;
  return [
    er * z[0] - ei * z[1] + acceleration * fr + jerk * gr,
    er * z[1] + ei * z[0] + acceleration * fi + jerk * gi,
  ];
}

// Adds weight times z at rising times to the sums re and im.
function addResponse(pieces, weight, decay, omega, times, re, im) {
  const total = totalOf(pieces);
  let z = [0, 0], k = 0;
  for (let i = 0; i < times.length; i++) {
    const t = times[i];
    while (k < pieces.length && pieces[k].begin + pieces[k].duration <= t) {
      const p = pieces[k++];
      z = advance(z, decay, omega, p.acceleration, p.jerk, p.duration);
    }
    const here = k < pieces.length
      ? advance(z, decay, omega, pieces[k].acceleration, pieces[k].jerk, t - pieces[k].begin)
      : advance(z, decay, omega, 0, 0, t - total);
    re[i] += weight * here[0];
    im[i] += weight * here[1];
  }
}

// Displacement of a mode at rising times [mm]: of one oscillator as it swings; of a spectrum, whose
// lines count together, the envelope. `carried` has the pieces and the way of each axis.
function vibration(carried, modes, mode, times) {
  const out = new Float64Array(times.length);
  const members = [];
  for (let m = 0; m < modes.group.length; m++) if (modes.group[m] === mode) members.push(m);
  for (const m of members) {
    const re = new Float64Array(times.length), im = new Float64Array(times.length);
    for (const part of carried) {
      let weight = 0;
      for (let a = 0; a < 9; a++) weight += modes.participation[9 * m + a] * part.way[a];
      if (weight) addResponse(part.pieces, weight, modes.decay[m], modes.omega[m], times, re, im);
    }
    for (let i = 0; i < out.length; i++) {
      if (members.length === 1) out[i] = -im[i] / modes.omega[m];
      else out[i] += (re[i] * re[i] + im[i] * im[i]) / (modes.omega[m] * modes.omega[m]);
    }
  }
  return members.length === 1 ? out : out.map(Math.sqrt);
}

// Moments and accelerations at both sides of every boundary of a profile, times a way.
function accelerationCorners(pieces, way) {
  const corners = [[0, 0]];
  for (const p of pieces) {
    corners.push([p.begin, way * p.acceleration]);
    corners.push([p.begin + p.duration, way * (p.acceleration + p.jerk * p.duration)]);
  }
  corners.push([totalOf(pieces), 0]);
  return corners;
}

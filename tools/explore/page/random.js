// Random numbers as host/base/random.hpp has them: std::mt19937_64 (Matsumoto and Nishimura).

const most64 = (1n << 64n) - 1n;

class Random {
  constructor(seed) {
    this.words = [BigInt(seed) & most64];
    for (let i = 1; i < 312; ++i) {
      const last = this.words[i - 1];
      this.words.push((6364136223846793005n * (last ^ (last >> 62n)) + BigInt(i)) & most64);
    }
    this.next = 312;
  }

  bits() {
    if (this.next === 312) {
      for (let i = 0; i < 312; ++i) {
        const high = this.words[i] & 0xFFFFFFFF80000000n, low = this.words[(i + 1) % 312] & 0x7FFFFFFFn;
        const x = high | low;
        this.words[i] = this.words[(i + 156) % 312] ^ (x >> 1n) ^ (x & 1n ? 0xB5026F5AA96619E9n : 0n);
      }
      this.next = 0;
    }
    let x = this.words[this.next++];
    x ^= (x >> 29n) & 0x5555555555555555n;
    x ^= (x << 17n) & 0x71D67FFFEDA60000n;
    x ^= (x << 37n) & 0xFFF7EEE000000000n;
    return x ^ (x >> 43n);
  }

  /** Uniform in [0, 1). */
  uniform() { return Number(this.bits() >> 11n) / 2 ** 53; }
}

/** A copy in the order of this seed (Fisher and Yates), as host/map/knobs.cpp shuffles. */
export function shuffled(list, seed) {
  const random = new Random(seed), result = [...list];
  for (let i = result.length; i > 1; --i) {
    const j = Math.floor(random.uniform() * i);
    [result[i - 1], result[j]] = [result[j], result[i - 1]];
  }
  return result;
}

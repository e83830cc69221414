// A feed-forward network in single precision, as `draft.learn.policy.onnx_file.Network` runs it.

export class Network {
  /**
   * @param {Float32Array} mean of the input
   * @param {Float32Array} divisor of the input
   * @param {[Float32Array, Float32Array][]} layers weights (outputs x inputs, by rows) and bias
   */
  constructor(mean, divisor, layers) {
    this.numbers = mean;
    this.mean = mean;
    this.divisor = divisor;
    this.layers = layers;
    this.outputs = layers.map(([, bias]) => new Float32Array(bias.length));
    this.input = new Float32Array(mean.length);
  }

  /**
   * Read a network from its numbers in one row: mean, divisor, then weights and bias of each layer.
   * @param {Float32Array} numbers
   * @param {number[]} sizes of the input, of each hidden layer and of the output
   */
  static read(numbers, sizes) {
    let at = 0;
    const take = (/** @type {number} */ count) => numbers.subarray(at, (at += count));
    const mean = take(sizes[0]), divisor = take(sizes[0]);
    const made = new Network(mean, divisor, sizes.slice(1).map((size, i) => [take(size * sizes[i]), take(size)]));
    made.numbers = numbers;
    return made;
  }

  /**
   * Change some of the numbers of the row.
   * @param {number[]} places
   * @param {ArrayLike<number>} values
   */
  put(places, values) {
    places.forEach((at, i) => { this.numbers[at] = values[i]; });
  }

  /**
   * Mean actions of an observation; the array is used again by the next call.
   * @param {ArrayLike<number>} values
   * @returns {Float32Array}
   */
  run(values) {
    let x = this.input;
    for (let i = 0; i < x.length; i++)
      x[i] = Math.fround(Math.fround(values[i]) - this.mean[i]) / this.divisor[i];
    this.layers.forEach(([weight, bias], layer) => {
      const out = this.outputs[layer], inputs = x.length, last = layer === this.layers.length - 1;
      for (let i = 0, k = 0; i < out.length; i++) {
        let sum = bias[i];
        for (let j = 0; j < inputs; j++, k++) sum += weight[k] * x[j];
        out[i] = last || sum > 0 ? sum : Math.expm1(sum); // ELU
      }
      x = out;
    });
    return x;
  }
}

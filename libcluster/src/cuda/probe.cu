// SPDX-License-Identifier: Apache-2.0
// Compiled at configuration time, to test whether nvcc, its host compiler and the requested GPUs
// are compatible.
#include <span>
#include <string>

__global__ void probe(float* values) { values[threadIdx.x] = 0.0f; }

std::string run_probe(std::span<float> values) {
  probe<<<1, 1>>>(values.data());
  return cudaGetErrorString(cudaGetLastError());
}

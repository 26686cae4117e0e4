// SPDX-License-Identifier: Apache-2.0
// Drives a libFuzzer target without libFuzzer: seeded mutations of the corpus, so that every
// compiler and every build runs it. usage: fuzz_X [-runs=N] [-seed=N] CORPUS_FOLDER

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <random>
#include <vector>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace {

using Input = std::vector<std::uint8_t>;

Input mutate(const std::vector<Input>& corpus, std::mt19937_64& random) {
  Input in = corpus[random() % corpus.size()];
  for (int n = 1 + int(random() % 4); n > 0; --n) {
    const std::size_t at = in.empty() ? 0 : random() % in.size();
    switch (random() % 6) {
      case 0:
        if (!in.empty()) in[at] ^= std::uint8_t(1U << random() % 8);
        break;
      case 1:
        if (!in.empty()) in[at] = std::uint8_t(random());
        break;
      case 2:
        in.resize(at);
        break;
      case 3:
        in.insert(in.begin() + std::ptrdiff_t(at), 1 + random() % 8, std::uint8_t(random()));
        break;
      case 4:
        for (std::size_t i = at; i < std::min(at + 4, in.size()); ++i) in[i] = 0xFF;
        break;
      default: {
        const Input& other = corpus[random() % corpus.size()];
        if (!other.empty())
          in.insert(in.begin() + std::ptrdiff_t(at), other.begin(),
                    other.begin() + std::ptrdiff_t(random() % other.size()));
      }
    }
  }
  return in;
}

}  // namespace

int main(int argc, char** argv) {
  unsigned long runs = 10'000;
  unsigned long seed = 1;
  std::vector<Input> corpus = {{}, Input(64, 0), Input(64, 0xFF)};
  for (int i = 1; i < argc; ++i) {
    if (std::strncmp(argv[i], "-runs=", 6) == 0) {
      runs = std::strtoul(argv[i] + 6, nullptr, 10);
    } else if (std::strncmp(argv[i], "-seed=", 6) == 0) {
      seed = std::strtoul(argv[i] + 6, nullptr, 10);
    } else {
      for (const auto& entry : std::filesystem::directory_iterator(argv[i])) {
        std::ifstream file(entry.path(), std::ios::binary);
        corpus.emplace_back(std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>());
      }
    }
  }
  for (const Input& in : corpus) LLVMFuzzerTestOneInput(in.data(), in.size());
  std::mt19937_64 random(seed);
  for (unsigned long i = 0; i < runs; ++i) {
    const Input in = mutate(corpus, random);
    LLVMFuzzerTestOneInput(in.data(), in.size());
  }
  std::printf("%lu inputs from %zu seeds\n", runs, corpus.size());
}

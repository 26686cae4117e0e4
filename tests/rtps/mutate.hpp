// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <random>
#include <vector>

#include "build.hpp"

namespace crane::test {

/// Makes of real RTPS traffic what nobody sends: it knows submessages, number sets, fragments,
/// parameter lists and lengths, and changes one or several of them, so that the rest still fits.
/// Seeded.
class Mutator {
 public:
  /// Prefixes of participants that live: so that what is changed is believed.
  Mutator(std::vector<Datagram> corpus, std::uint32_t seed);

  Datagram next();

 private:
  struct Part {
    std::uint8_t id = 0, flags = 0;
    Datagram body;
  };
  std::vector<Part> split(const Datagram& d) const;
  Datagram join(const Datagram& header, const std::vector<Part>& parts);
  void change(Part& part);
  void change_numbers(Part& part, std::size_t at, std::size_t words);
  void change_list(Datagram& d, std::size_t at, bool little);
  void change_bytes(Datagram& d);
  Part invent();
  std::uint32_t nasty();
  std::size_t below(std::size_t n) { return n == 0 ? 0 : random_() % n; }
  const Datagram& any() { return corpus_[below(corpus_.size())]; }

  std::vector<Datagram> corpus_;
  std::mt19937 random_;
};

}  // namespace crane::test

// SPDX-License-Identifier: Apache-2.0
#pragma once

// Sets the fields of samples.h in a sample `s` of the generated C++.
// set() of its nested types is the includer's.

#define SET_F(f, v) s.f(v);
#define SET_S(f, v) s.f(v);
#define SET_B(f, n) \
  s.f().resize(n);  \
  for (std::size_t i = 0; i < (n); ++i) s.f()[i] = BYTE_AT(i);
#define SET_A(f, n, v) \
  for (std::size_t i = 0; i < (n); ++i) s.f()[i] = v;
#define SET_O(f, T, FIELDS) set(s.f(), 0);
#define SET_Q(f, T, n, FIELDS) \
  s.f().resize(n);             \
  for (std::size_t q = 0; q < (n); ++q) set(s.f()[q], q);

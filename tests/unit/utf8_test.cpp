// SPDX-License-Identifier: Apache-2.0
#include "base/utf8.hpp"

#include <gtest/gtest.h>

namespace crane {
namespace {

TEST(Utf8, IsLeftAsItIs) {
  for (const std::string text : {"", "rig", "Kr\xC3\xA4n", "\xE2\x82\xAC", "\xF0\x9F\x8F\x97",
                                 "\xED\x9F\xBF", "\xF4\x8F\xBF\xBF", "a\nb\t\"c\\"}) {
    EXPECT_EQ(first_not_utf8(text), std::string::npos);
    EXPECT_EQ(with_bytes_escaped(text), text);
  }
  EXPECT_EQ(with_bytes_escaped(std::string("a\0b", 3)), std::string("a\0b", 3));
}

TEST(Utf8, EveryOtherByteIsWrittenAsItsNumber) {
  EXPECT_EQ(with_bytes_escaped("/old/Kr\xE4n/rec"), "/old/Kr\\xe4n/rec");
  EXPECT_EQ(with_bytes_escaped("\xE4"), "\\xe4");                    // cut at the end
  EXPECT_EQ(with_bytes_escaped("\xE2\x82"), "\\xe2\\x82");           // cut within a character
  EXPECT_EQ(with_bytes_escaped("\xC0\xAF"), "\\xc0\\xaf");           // longer than needed
  EXPECT_EQ(with_bytes_escaped("\xED\xA0\x80"), "\\xed\\xa0\\x80");  // half a surrogate pair
  EXPECT_EQ(with_bytes_escaped("\xF5\x80\x80\x80"), "\\xf5\\x80\\x80\\x80");
  EXPECT_EQ(with_bytes_escaped("\x80"
                               "a\xFF"),
            "\\x80a\\xff");
  EXPECT_EQ(first_not_utf8("a\xC3\xA4\xE4z"), 3U);
}

TEST(Utf8, WhateverBytesComeTheResultIsUtf8) {
  unsigned state = 1;
  for (int round = 0; round < 5000; ++round) {
    std::string text;
    for (int i = 0; i < 12; ++i) {
      state = state * 1664525U + 1013904223U;
      text += static_cast<char>(state >> 24U);
    }
    EXPECT_EQ(first_not_utf8(with_bytes_escaped(text)), std::string::npos);
  }
}

}  // namespace
}  // namespace crane

// SPDX-License-Identifier: Apache-2.0
#include "service/decimal_options.hpp"

#include <gtest/gtest.h>

#include <CLI/CLI.hpp>
#include <cstdint>
#include <vector>

namespace crane {
namespace {

struct Options {
  int domain = -1;
  std::uint32_t id = 0;
  std::int64_t start = 0;
  double voxel = 0;
  std::vector<double> load;
  std::string name;
};

/// Whether the command line is taken.
bool parse(const std::vector<std::string>& arguments, Options& o) {
  CLI::App app("a test");
  CLI::App* sub = app.add_subcommand("go");
  sub->add_option("--domain", o.domain)->check(CLI::Range(0, 232));
  sub->add_option("--id", o.id);
  sub->add_option("--start", o.start);
  sub->add_option("--voxel", o.voxel)->check(CLI::Range(0.0, 2.0));
  sub->add_option("--load", o.load)->expected(3);
  sub->add_option("NAME", o.name);
  take_decimal_numbers(app);
  std::vector<std::string> reversed(arguments.rbegin(), arguments.rend());
  reversed.emplace_back("go");
  try {
    app.parse(reversed);
  } catch (const CLI::ParseError&) {
    return false;
  }
  return true;
}

TEST(DecimalOptions, LeadingZerosAreOfNoMeaning) {
  Options o;
  ASSERT_TRUE(parse({"--domain", "010", "--id", "0009", "--start", "-012", "--voxel", "00.5"}, o));
  EXPECT_EQ(o.domain, 10);
  EXPECT_EQ(o.id, 9U);
  EXPECT_EQ(o.start, -12);
  EXPECT_EQ(o.voxel, 0.5);
  ASSERT_TRUE(parse({"--domain", "000"}, o));
  EXPECT_EQ(o.domain, 0);
}

TEST(DecimalOptions, TextsAndOrdinaryNumbersAreAsTheyAre) {
  Options o;
  ASSERT_TRUE(parse({"007", "--load", "1", "-2.5", "3e-1", "--start", "1700000000000000000"}, o));
  EXPECT_EQ(o.name, "007");
  EXPECT_EQ(o.load, (std::vector<double>{1, -2.5, 0.3}));
  EXPECT_EQ(o.start, 1'700'000'000'000'000'000);
}

TEST(DecimalOptions, OtherNotationsAndWhatIsOutOfRangeAreRefused) {
  Options o;
  for (const char* bad : {"0x10", "1e1", "5.0", "0b1", "ten", "", "300", "1_0"})
    EXPECT_FALSE(parse({"--domain", bad}, o)) << bad;
  for (const char* bad : {"nan", "inf", "0x1", "1,5", "5cm", "3"})
    EXPECT_FALSE(parse({"--voxel", bad}, o)) << bad;
  EXPECT_FALSE(parse({"--id", "-1"}, o));
  EXPECT_FALSE(parse({"--load", "1", "nan", "1"}, o));
}

}  // namespace
}  // namespace crane

// SPDX-License-Identifier: Apache-2.0
// What YAML readers do not agree on, or drop in silence, is refused with its line.
#include "config/yaml_strict.hpp"

#include <gtest/gtest.h>

#include "config/site_config.hpp"
#include "config/yaml_reader.hpp"

namespace crane {
namespace {

std::string problem(const std::string& text) {
  const auto read = parse_site_config(text, "site.yaml");
  return read ? std::string() : read.error().text();
}

void expect_problem(const std::string& text, const std::string& says) {
  EXPECT_NE(problem(text).find(says), std::string::npos) << text << "\n" << problem(text);
}

TEST(StrictYaml, AKeyOrSectionThatStandsTwiceIsNamedWithBothLines) {
  expect_problem("crane: 1\ndds: {domain: 3}\ncrane: 2\n",
                 "site.yaml:3: 'crane' stands here again, first in line 1");
  expect_problem("hoist:\n  enabled: false\nmapper:\n  voxel_m: 0.1\nhoist:\n  enabled: true\n",
                 "site.yaml:5: 'hoist' stands here again, first in line 1");
  expect_problem("mapper:\n  voxel_m: 0.1\n  forget_s: 2\n  voxel_m: 0.2\n",
                 "site.yaml:4: 'mapper.voxel_m' stands here again, first in line 2");
  expect_problem("dds: {domain: 1, domain: 1}\n", "'dds.domain' stands here again");
  expect_problem("crane: 1\n\"crane\": 1\n", "'crane' stands here again");
  expect_problem("zones:\n  - {id: 1, id: 2, corners: []}\n", "'zones.id' stands here again");
  expect_problem("no_such: 1\nno_such: 1\n", "'no_such' stands here again");
  // In what is ignored as well: the same reader reads calibrations.
  const auto y = YamlReader::from_text("comment: {a: 1, a: 2}\n", "sensor.yaml");
  ASSERT_FALSE(y);
  EXPECT_NE(y.error().text().find("'comment.a'"), std::string::npos);
}

TEST(StrictYaml, TheSameKeyInDifferentSectionsIsNone) {
  EXPECT_EQ(problem("stereo: {nearest_m: 1}\nmapper: {method: paper}\nhoist: {margin_m: 1}\n"), "");
  EXPECT_EQ(problem("zones:\n  - {id: 1, corners: [{x: 0, y: 0}, {x: 1, y: 0}, {x: 1, y: 1}]}\n"
                    "  - {id: 2, corners: [{x: 0, y: 0}, {x: 1, y: 0}, {x: 1, y: 1}]}\n"),
            "");
}

TEST(StrictYaml, ASecondDocumentIsRefused) {
  expect_problem("crane: 1\n---\ncrane: 2\n", "a second document begins here");
  expect_problem("---\n---\ncrane: 2\n", "a second document begins here");
  expect_problem("crane: 1\n...\n---\ndds: {domain: 3}\n", "site.yaml:3");
  EXPECT_EQ(problem("%YAML 1.2\n---\ncrane: 1\n"), "");
  EXPECT_EQ(problem("---\ncrane: 1\n...\n"), "");
}

/// yaml-cpp goes on for ever at some of these.
TEST(StrictYaml, AnyBrokenEndIsReachedAndRefused) {
  for (const char* end : {"]", "}", "crane: 1\n]", "crane: 1\n}\n", "crane: 1\n...\n]",
                          "a: b\n- c\n", "? a\n] b", ",", ": :", "- a\nb: c\n", "crane: 1\n, 2"})
    EXPECT_NE(problem(end), "") << end;
}

TEST(StrictYaml, NumbersAreDecimalWithLeadingZerosOrNot) {
  const auto crane = [](const std::string& value) {
    const auto read = parse_site_config("crane: " + value + "\n", "x");
    return read ? read->crane : -1;
  };
  EXPECT_EQ(crane("010"), 10);
  EXPECT_EQ(crane("08"), 8);
  EXPECT_EQ(crane("0009"), 9);
  EXPECT_EQ(crane("+7"), 7);
  EXPECT_EQ(crane("'012'"), 12);
  for (const char* bad :
       {"0x10", "0o10", "0b11", "1_000", "1e3", "5.0", "12:30", "1,000", "ten", "10 cm", "", "~",
        "-", "99999999999999999999", "\xEF\xBC\x91", "[1]", "{a: 1}", ".inf", "true"})
    EXPECT_EQ(crane(bad), -1) << bad;
  expect_problem("crane: 0x10\n", "site.yaml:1: 'crane' is not a whole number: '0x10'");
}

TEST(StrictYaml, RealNumbersAreFiniteAndDecimal) {
  const auto forget = [](const std::string& value) {
    const auto read = parse_site_config("mapper: {forget_s: " + value + "}\n", "x");
    return read ? read->mapper.forget_s : -1;
  };
  EXPECT_EQ(forget("010.5"), 10.5);
  EXPECT_EQ(forget("1e2"), 100);
  EXPECT_EQ(forget("60."), 60);
  EXPECT_EQ(forget("2.5E+1"), 25);
  for (const char* bad : {".inf", "-.inf", ".nan", "inf", "nan", "0x20", "1_0", "60s", "1.5.2",
                          "'1,5'", "1e", ".", "e5", "1e999"})
    EXPECT_EQ(forget(bad), -1) << bad;
}

TEST(StrictYaml, FlagsAreWordsEverybodyReadsAlike) {
  const auto enabled = [](const std::string& value) {
    const auto read = parse_site_config("hoist: {enabled: " + value + "}\n", "x");
    return read ? static_cast<int>(read->hoist.enabled) : -1;
  };
  for (const char* yes : {"true", "True", "TRUE", "yes", "on", "Yes", "ON"})
    EXPECT_EQ(enabled(yes), 1) << yes;
  for (const char* no : {"false", "False", "no", "off", "NO"}) EXPECT_EQ(enabled(no), 0) << no;
  for (const char* bad : {"1", "0", "tRue", "yEs", "yess", "y", "ja", "nope", "~", "''"})
    EXPECT_EQ(enabled(bad), -1) << bad;
}

TEST(StrictYaml, AKeyWithoutAValueIsNoDefault) {
  expect_problem("crane:\n", "'crane' has no value");
  expect_problem("mapper:\n  voxel_m: ~\n", "site.yaml:2: 'mapper.voxel_m' has no value");
  expect_problem("dds:\n  interfaces:\n", "'dds.interfaces' has no value");
  EXPECT_EQ(problem("dds:\nmapper:  # all at their defaults\nzones:\n"), "");
}

TEST(StrictYaml, AliasesAndKeysThatAreNoTextAreRefused) {
  expect_problem("dds: &a {domain: 1}\nmapper: *a\n", "alias");
  expect_problem("a: &a [*a, *a]\n", "alias");
  expect_problem("? [crane]\n: 1\n", "a key is a list or a map");
  EXPECT_NE(problem("<<: {crane: 3}\n"), "");
}

TEST(StrictYaml, LineEndsByteOrderMarkAndTabs) {
  const auto read = parse_site_config(
      "\xEF\xBB\xBF"
      "crane: 7\r\ndds:\r\n  domain: 3\r\n",
      "x");
  ASSERT_TRUE(read) << read.error().text();
  EXPECT_EQ(read->crane, 7);
  EXPECT_EQ(read->dds.domain, 3);
  EXPECT_NE(problem("dds:\n\tdomain: 3\n"), "");
  const auto tab = parse_site_config("crane:\t7\t# the seventh\n", "x");
  ASSERT_TRUE(tab) << tab.error().text();
  EXPECT_EQ(tab->crane, 7);
  EXPECT_NE(problem(std::string("crane: 7\0dds: {domain: 3}\n", 26)), "");
  EXPECT_NE(problem("dds: {identity: \"a\\0b\"}\n"), "");
}

TEST(StrictYaml, AFileThatIsNotUtf8IsNamedWithTheLine) {
  expect_problem("crane: 1\ndds: {security: Kr\xE4n}\n",
                 "site.yaml:2: holds bytes that are not UTF-8");
  expect_problem(std::string("\xFF\xFE"
                             "c\0r\0",
                             6),
                 "UTF-8");
  EXPECT_EQ(problem("dds: {security: Kr\xC3\xA4n}\n"), "");
}

TEST(StrictYaml, NestingOfAnyKindIsBounded) {
  std::string dashes, indent, flow(150, '['), keys;
  for (int i = 0; i < 20'000; ++i) dashes += "- ";
  for (int i = 0; i < 150; ++i) indent += std::string(static_cast<std::size_t>(i), ' ') + "a:\n";
  for (int i = 0; i < 5000; ++i) keys += "? ";
  for (const std::string& text : {"a:\n" + dashes + "1\n", indent, "a: " + flow, keys + "1\n"})
    EXPECT_NE(problem(text), "");
}

TEST(StrictYaml, EveryProblemIsListedButNotThousands) {
  std::string text;
  for (int i = 0; i < 3000; ++i) text += "crane: 1\n";
  EXPECT_NE(problem(text), "");
  EXPECT_LT(problem(text).size(), 4000U);
}

}  // namespace
}  // namespace crane

// SPDX-License-Identifier: Apache-2.0
#include "rtps_guard/parameters.hpp"

#include <algorithm>
#include <iterator>

#include "rtps_guard/tokens.hpp"

namespace crane::guard {
namespace {

/// What a parameter's value is. The sizes are those that Fast DDS's readers insist on or rely on.
enum class Content : std::uint8_t {
  kBytes,   ///< exactly so many
  kOpaque,  ///< read by nobody
  kString,
  kStrings,     ///< count, strings
  kProperties,  ///< count, pairs of strings; binary ones may follow
  kOctets,      ///< count, octets, padding
  kShorts,      ///< count, numbers of 2 bytes
  kLongs,       ///< count, numbers of 8 bytes
  kToken,
  kConsistency,  ///< kind and up to five flags
};

struct Row {
  std::uint16_t id;
  Content content;
  std::uint16_t bytes = 0;
};

constexpr Row kTable[] = {
    {0x0000, Content::kOpaque},       // padding
    {0x0002, Content::kBytes, 8},     // participant's lease
    {0x0004, Content::kBytes, 8},     // time-based filter
    {0x0005, Content::kString},       // topic name
    {0x0006, Content::kBytes, 4},     // ownership strength
    {0x0007, Content::kString},       // type name
    {0x000B, Content::kBytes, 4},     // addresses and ports of RTPS 1
    {0x000C, Content::kBytes, 4},     //
    {0x000D, Content::kBytes, 4},     //
    {0x000E, Content::kBytes, 4},     //
    {0x000F, Content::kBytes, 4},     // domain
    {0x0011, Content::kBytes, 4},     //
    {0x0015, Content::kBytes, 4},     // protocol version
    {0x0016, Content::kBytes, 4},     // vendor
    {0x001A, Content::kBytes, 12},    // reliability
    {0x001B, Content::kBytes, 12},    // liveliness
    {0x001D, Content::kBytes, 4},     // durability
    {0x001E, Content::kBytes, 28},    // durability service
    {0x001F, Content::kBytes, 4},     // ownership
    {0x0021, Content::kBytes, 8},     // presentation
    {0x0023, Content::kBytes, 8},     // deadline
    {0x0025, Content::kBytes, 4},     // destination order
    {0x0027, Content::kBytes, 8},     // latency budget
    {0x0029, Content::kStrings},      // partition
    {0x002B, Content::kBytes, 8},     // lifespan
    {0x002C, Content::kOctets},       // user data
    {0x002D, Content::kOctets},       // group data
    {0x002E, Content::kOctets},       // topic data
    {0x002F, Content::kBytes, 24},    // locators
    {0x0030, Content::kBytes, 24},    //
    {0x0031, Content::kBytes, 24},    //
    {0x0032, Content::kBytes, 24},    //
    {0x0033, Content::kBytes, 24},    //
    {0x0034, Content::kBytes, 4},     // liveliness count
    {0x0035, Content::kOpaque},       // content filter: taken out
    {0x0040, Content::kBytes, 8},     // history
    {0x0041, Content::kBytes, 12},    // resource limits
    {0x0043, Content::kBytes, 4},     // expects inline QoS
    {0x0044, Content::kBytes, 4},     // built-in endpoints of RTPS 1
    {0x0045, Content::kBytes, 4},     // addresses and ports of RTPS 1
    {0x0046, Content::kBytes, 4},     //
    {0x0048, Content::kBytes, 24},    // locator
    {0x0049, Content::kBytes, 4},     // transport priority
    {0x0050, Content::kBytes, 16},    // participant
    {0x0051, Content::kBytes, 4},     // participant's entity
    {0x0052, Content::kBytes, 16},    // group
    {0x0053, Content::kBytes, 4},     // group's entity
    {0x0055, Content::kOpaque},       // content filter info
    {0x0056, Content::kBytes, 8},     // coherent set
    {0x0057, Content::kBytes, 16},    // directed write
    {0x0058, Content::kBytes, 4},     // built-in endpoints
    {0x0059, Content::kProperties},   // properties
    {0x005A, Content::kBytes, 16},    // endpoint
    {0x0060, Content::kBytes, 4},     // largest serialized size
    {0x0061, Content::kOpaque},       // original writer
    {0x0062, Content::kString},       // entity name
    {0x0063, Content::kBytes, 8},     // group's coherent set and number
    {0x0064, Content::kBytes, 8},     //
    {0x0065, Content::kOpaque},       // writer group
    {0x0066, Content::kOpaque},       //
    {0x0069, Content::kOpaque},       // type: taken out
    {0x0070, Content::kBytes, 16},    // key hash
    {0x0071, Content::kBytes, 4},     // status
    {0x0072, Content::kOpaque},       // type: taken out
    {0x0073, Content::kShorts},       // data representation
    {0x0074, Content::kConsistency},  // type consistency
    {0x0075, Content::kOpaque},       // type: taken out
    {0x0077, Content::kBytes, 4},     // QoS of built-in endpoints
    {0x0083, Content::kBytes, 24},    // related sample
    {0x1001, Content::kToken},        // identity
    {0x1002, Content::kToken},        // permissions
    {0x1003, Content::kOpaque},       // data tags
    {0x1004, Content::kBytes, 8},     // endpoint's security
    {0x1005, Content::kBytes, 8},     // participant's security
    {0x1006, Content::kToken},        // identity's status
    {0x1007, Content::kOpaque},       // algorithms of DDS Security 1.2
    {0x1008, Content::kOpaque},       //
    {0x1009, Content::kOpaque},       //
    {0x1010, Content::kOpaque},       //
    {0x1011, Content::kOpaque},       //
    {0x1012, Content::kOpaque},       //
    {0x1013, Content::kOpaque},       //
    {0x1014, Content::kOpaque},       //
    {0x4014, Content::kString},       // domain's tag
    {0x8002, Content::kBytes, 16},    // eProsima: persistence
    {0x8005, Content::kBytes, 4},     // eProsima: no positive acknowledgements
    {0x8006, Content::kLongs},        // eProsima: data-sharing
    {0x800F, Content::kBytes, 24},    // eProsima: related sample
};

/// In ascending order: found by halving.
constexpr bool ascending() {
  for (std::size_t i = 1; i < std::size(kTable); ++i)
    if (kTable[i - 1].id >= kTable[i].id) return false;
  return true;
}
static_assert(ascending());

/// Real announcements have 20 to 40.
constexpr unsigned kMostParameters = 256;

bool numbers_fit(Cursor& c, std::size_t bytes) {
  if (!c.has(4)) return false;
  const std::uint32_t count = c.u32();
  if (count > c.left() / bytes) return false;
  return c.left() - std::size_t{count} * bytes < 4;
}

bool strings_fit(Cursor& c) {
  if (!c.has(4)) return false;
  for (std::uint32_t n = c.u32(); n > 0; --n)
    if (!read_string(c)) return false;
  return c.left() == 0;
}

bool properties_fit(Cursor& c) {
  if (!c.has(4)) return false;
  for (std::uint32_t n = c.u32(); n > 0; --n)
    if (!read_string(c) || !read_string(c)) return false;
  return true;
}

bool octets_fit(Cursor& c) {
  return numbers_fit(c, 1);
}

Refusal flaw(const Row& row, Bytes value, bool little) {
  Cursor c(value, little);
  const auto or_parameter = [](bool fits) { return fits ? Refusal::kNone : Refusal::kParameter; };
  switch (row.content) {
    case Content::kBytes:
      return or_parameter(value.size() == row.bytes);
    case Content::kOpaque:
      return Refusal::kNone;
    case Content::kString:
      return or_parameter(read_string(c) && c.left() == 0);
    case Content::kStrings:
      return or_parameter(strings_fit(c));
    case Content::kProperties:
      return or_parameter(properties_fit(c));
    case Content::kOctets:
      return or_parameter(octets_fit(c));
    case Content::kShorts:
      return or_parameter(numbers_fit(c, 2));
    case Content::kLongs:
      return or_parameter(numbers_fit(c, 8));
    case Content::kConsistency:
      return or_parameter(value.size() == 4 || value.size() == 8);
    case Content::kToken:
      return read_data_holder(c) && c.left() == 0 ? Refusal::kNone : Refusal::kToken;
  }
  return Refusal::kParameter;
}

}  // namespace

bool ParameterWalk::next(Parameter& out) {
  if (refusal_ != Refusal::kNone) return false;
  if (!cursor_.has(4) || ++read_ > kMostParameters) return refuse(Refusal::kParameterList);
  out.offset = cursor_.at();
  out.id = cursor_.u16();
  const std::uint16_t length = cursor_.u16();
  if (out.id == kPidSentinel) return false;
  if (length % 4 != 0 || !cursor_.has(length)) return refuse(Refusal::kParameterList);
  out.value = cursor_.take(length);
  const auto* row = std::lower_bound(std::begin(kTable), std::end(kTable), out.id,
                                     [](const Row& r, std::uint16_t id) { return r.id < id; });
  if (row == std::end(kTable) || row->id != out.id) {
    // 0x8000: a vendor's own. 0x4000: must be understood, and is not.
    const bool ignorable = (out.id & 0x8000U) != 0 && (out.id & 0x4000U) == 0;
    return ignorable || refuse(Refusal::kUnknownParameter);
  }
  const Refusal found = flaw(*row, out.value, cursor_.little());
  return found == Refusal::kNone || refuse(found);
}

std::string_view string_of(const Parameter& parameter, bool little) {
  Cursor c(parameter.value, little);
  const std::uint32_t length = c.u32();
  return {reinterpret_cast<const char*>(parameter.value.data()) + 4, length - 1};
}

}  // namespace crane::guard

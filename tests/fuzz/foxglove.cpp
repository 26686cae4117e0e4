// SPDX-License-Identifier: Apache-2.0
// What a viewer may say by Foxglove's protocol, a message a line: whatever it is, subscriptions are
// bounded, channels are wanted as long as there are any, and what is said back is sound.
#include <cstdint>
#include <cstdlib>
#include <string>

#include "gateway/foxglove_feed.hpp"
#include "gateway/json.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace crane;
  using namespace crane::gateway;
  FoxgloveChannels channels;
  {
    FoxgloveFeed feed(channels, "fuzz", [] { return TimeNs{0}; });
    std::string text(reinterpret_cast<const char*>(data), size);
    text += '\n';
    bool open = true;
    for (std::size_t from = 0, end = 0; open && (end = text.find('\n', from)) != text.npos;
         from = end + 1) {
      open = feed.hear(std::string_view(text).substr(from, end - from));
      for (std::size_t i = 0; i < kChannels; ++i) channels.put(static_cast<Channel>(i), 1, "{}");
      if (feed.subscriptions() > FoxgloveFeed::kMostSubscriptions) std::abort();
      std::size_t said = 0;
      while (const auto message = feed.next()) {
        if (++said > 2 + 8 + 64 * FoxgloveFeed::kMostSubscriptions) std::abort();
        if (message->binary ? message->bytes.size() != 15 || message->bytes[0] != 1
                            : !Json::parse(message->bytes, nullptr, false).is_object())
          std::abort();
      }
    }
  }
  for (std::size_t i = 0; i < kChannels; ++i)
    if (channels.wanted(static_cast<Channel>(i))) std::abort();
  return 0;
}

// RTPS datagrams as the guard before Fast DDS sees them.
#include "dds/rtps_check.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static crane::dds::RtpsCheck check;
  const bool sound = crane::dds::rtps_flaw({data, size}) == nullptr;
  // With memory it refuses more, never less.
  if (!sound && check.flaw({data, size}) == nullptr) __builtin_trap();
  if (sound) (void)check.flaw({data, size});
  return 0;
}

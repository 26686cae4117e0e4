// SPDX-License-Identifier: Apache-2.0
#include "sensors/camera/load_module.hpp"

#include <dlfcn.h>

#include <string>

namespace crane {
namespace {

template <class Io>
Result<std::unique_ptr<Io>> load(const std::string& name, const char* packages) {
  const std::string file = "libcranemap-" + name + ".so";
  const auto missing = [&] {
    const char* why = dlerror();
    return Error{
        ErrorCode::kResource, file,
        std::string("cannot be loaded: ") + (why == nullptr ? "no reason given" : why),
        std::string("install ") + packages + "; it lies in ../lib/cranemap beside this program"};
  };
  void* module = dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL | RTLD_NODELETE);
  if (module == nullptr) return missing();
  using Make = Io* (*)();
  const auto make =
      reinterpret_cast<Make>(dlsym(module, ("cranemap_" + name + "_io").c_str()));  // NOLINT
  if (make == nullptr) return missing();
  return std::unique_ptr<Io>(make());
}

}  // namespace

Result<std::unique_ptr<GenicamIo>> load_genicam() {
  return load<GenicamIo>("genicam", "libaravis-0.8-0");
}

Result<std::unique_ptr<PipelineIo>> load_gstreamer() {
  return load<PipelineIo>("gstreamer",
                          "libgstreamer-plugins-base1.0-0 and gstreamer1.0-plugins-good");
}

}  // namespace crane

// SPDX-License-Identifier: Apache-2.0
#include "base/format.hpp"
#include "mount/mount_files.hpp"

namespace crane {

std::string mount_text(const MountCalibration& c) {
  static constexpr const char* kVerdict[] = {"GOOD", "USABLE", "BAD"};
  std::string out =
      formatted("%s: the mount, from %.0f s and %zu frames of driving\n",
                kVerdict[static_cast<int>(c.verdict)], c.drive.seconds, c.drive.frames);
  for (const MountValue& v : c.values) {
    const MountItemName& name = name_of(v.item);
    if (!v.determined)
      out += formatted("  %-40s not determined: %s\n", name.what, v.why_not.c_str());
    else if (name.decimals == 0)
      out += formatted("  %-40s %+.0f\n", name.what, v.value);
    else
      out += formatted("  %-40s %.*f +- %.*f %s\n", name.what, name.decimals, v.value,
                       name.decimals, v.sigma, name.unit);
  }
  for (const TargetCheck& t : c.targets) {
    out += formatted("  target %.2f, %.2f of %.3f m: ", t.target.place_m.x(), t.target.place_m.y(),
                     t.target.height_m);
    out += t.seen ? formatted("%.3f +- %.3f m, %s\n", t.height_m, t.sigma_m,
                              t.agrees ? "agrees" : "does NOT agree")
                  : "not seen\n";
  }
  for (const std::string& remark : c.remarks) out += "  - " + remark + "\n";
  return out;
}

}  // namespace crane

# SPDX-License-Identifier: Apache-2.0
# find_package(CraneMap) gives CraneMap::client, the crane controller's library, and CraneMap_IDL_DIR.
include(${CMAKE_CURRENT_LIST_DIR}/CraneMapTargets.cmake)
get_filename_component(CraneMap_IDL_DIR ${CMAKE_CURRENT_LIST_DIR}/../../../share/cranemap/idl ABSOLUTE)

// SPDX-License-Identifier: Apache-2.0
/* One sample of every topic, in a form that C and C++ can both fill and check: field by field.
 * F(field, value)  a number          S(field, text)         a string
 * B(field, count)  a sequence of bytes or of floats that are whole   A(field, count, value) an array; i = index
 * O(field, Type, FIELDS) a struct    Q(field, Type, count, FIELDS) a sequence of structs; k = index */
#ifndef CRANEMAP_TESTS_INTEROP_SAMPLES_H
#define CRANEMAP_TESTS_INTEROP_SAMPLES_H

#define STEREO_FRAME(F, S, B, A, O, Q)                                                             \
  F(crane, 1) F(encoding, 2) F(stream, 0xFEDCBA9876543210ULL) F(sequence_number, 7) F(after, -1)   \
  F(exposure_time_ns, 1700000000123456789LL) F(width, 640) F(height, 480)                          \
  B(left, 921603) B(right, 921600)

#define RANGEFINDER_POSITION(F, S, B, A, O, Q)                                                     \
  F(crane, 1) F(axis, 2) F(stream, 5000000000ULL) F(sequence_number, 8)                            \
  F(time_ns, 1700000000223456789LL) F(distance_m, 12.3456) F(accuracy_m, 0.003) F(device_status, 1)

#define HOIST_STATE(F, S, B, A, O, Q)                                                              \
  F(crane, 1) F(sequence_number, 9) F(time_ns, 1700000000323456789LL) F(hook_height_m, 4.25)       \
  F(sling_m, 1.5) F(load_size_x_m, 2.5) F(load_size_y_m, 1.25) F(load_size_z_m, 0.75)              \
  F(load_yaw_rad, -0.5) F(sway_x_m, 0.03) F(sway_y_m, -0.04) F(status, 1)

#define PARTIAL_CLOUD(F, S, B, A, O, Q)                                                            \
  F(crane, 1) F(has_colour, 1) F(stream, 5000000001ULL) F(sequence_number, 10) F(after, 9)         \
  F(exposure_time_ns, 1700000000423456789LL) F(frame_sent_ns, 1700000000423456999LL)               \
  F(f_px, 700.5) F(cx_px, 639.5) F(cy_px, 359.5) F(baseline_m, 0.12) F(sigma_disparity_px, 0.05)   \
  A(rotation, 9, i == 0 || i == 4 || i == 8 ? 1.0 : 0.0) F(row_offset_px, 0.125)                      \
  F(row_offset_sigma_px, 0.03125) F(row_roll_rad, -0.002) F(row_roll_sigma_rad, 0.0001)            \
  F(row_slope, 0.003) F(row_slope_sigma, 0.0002) F(width, 640) F(height, 480)              \
  F(matched_pixels, 300000) F(camera_dropped, 3) F(row_patches, 511) B(depth, 307200) \
  B(confidence, 307200) B(colour, 921600)

#define MAP_TILE(F, S, B, A, O, Q)                                                                 \
  F(crane, 1) F(tile_x, -300) F(tile_y, 20001) F(tile_z, -2) F(map_id, 0xABCDEF0123456789ULL)      \
  F(revision, 11) F(time_ns, 1700000000523456789LL) F(voxel_m, 0.05) F(encoding, 1)                \
  F(crc32c, 0xDEADBEEFU) B(payload, 60000)

#define HEIGHT_TILE(F, S, B, A, O, Q)                                                              \
  F(crane, 1) F(tile_x, 301) F(tile_y, -20002) F(map_id, 0xABCDEF0123456789ULL) F(revision, 12)    \
  F(time_ns, 1700000000623456789LL) F(voxel_m, 0.1) F(encoding, 1) F(crc32c, 0xCAFEF00DU)          \
  B(payload, 16000)

#define OCTREE_MAP(F, S, B, A, O, Q)                                                               \
  F(crane, 1) F(map_id, 0xABCDEF0123456789ULL) F(revision, 13) F(time_ns, 1700000000723456789LL)   \
  F(voxel_m, 0.02) F(encoding, 1) F(crc32c, 0x01020304U) F(decoded_bytes, 123456789)               \
  B(payload, 700000)

#define MAP_STATUS(F, S, B, A, O, Q)                                                               \
  F(crane, 1) F(sequence_number, 14) F(time_ns, 1700000000823456789LL) F(mapper, 0x1111222233334444ULL) \
  F(mapper_start_ns, 1690000000000000000LL) F(map_id, 0xABCDEF0123456789ULL) F(revision, 15)       \
  F(zones_revision, 16) F(voxel_digest, 0x8877665544332211ULL) F(height_digest, 0x1020304050607080ULL) \
  F(voxel_tiles, 1234) F(height_tiles, 1111) F(voxel_m, 0.05) F(validity, 1) F(paper_method, 1)    \
  F(hoist, 2) F(term, 123456789) F(ceiling_m, 8.75) F(forget_s, 3600) F(stream, 5000000002ULL) F(last_frame, 17)          \
  F(last_frame_time_ns, 1700000000823000000LL) F(frames_integrated, 18) F(frames_rejected, 19)     \
  F(frames_missing, 20) S(reason, "no cloud for more than 2000 ms")

#define TILE_REQUEST(F, S, B, A, O, Q)                                                             \
  F(crane, 1) F(reserved, 0) F(client, 0x5555666677778888ULL) F(sequence_number, 21)               \
  F(time_ns, 1700000000923456789LL) F(map_id, 0xABCDEF0123456789ULL)                               \
  A(voxel_digests, 64, i * 0x0101010101010101ULL) A(height_digests, 64, ~(i * 0x0011001100110011ULL))

#define ZONE_CORNER(F, S, B, A, O, Q) F(x_m, 1.5 + (double)k) F(y_m, -2.5 * (double)(k * k))
#define ZONE(F, S, B, A, O, Q)                                                                     \
  F(id, 22 + (unsigned)k) F(kind, 1) F(active, 1) F(switchable, 0) F(z_min_m, -0.5) F(z_max_m, 9.5) \
  S(name, "welding cell") Q(corners, ZoneCorner, 5, ZONE_CORNER)

#define ZONE_SET(F, S, B, A, O, Q)                                                                 \
  F(crane, 1) F(reserved, 0) F(map_id, 0xABCDEF0123456789ULL) F(revision, 23)                      \
  F(time_ns, 1700000001023456789LL) Q(zones, Zone, 3, ZONE)

#define ZONE_COMMAND(F, S, B, A, O, Q)                                                             \
  F(crane, 1) F(action, 1) F(client, 0x9999AAAABBBBCCCCULL) F(sequence_number, 24)                 \
  F(time_ns, 1700000001123456789LL) O(zone, Zone, ZONE)

#define CLEARANCE_POSE(F, S, B, A, O, Q)                                                           \
  F(x_m, 0.5 * (double)k) F(y_m, 30.25 - (double)k) F(z_m, 2.125) F(yaw_rad, 0.1 * (double)k)
#define CLEARANCE_REQUEST(F, S, B, A, O, Q)                                                        \
  F(crane, 1) F(min_views, 3) F(client, 0xDDDDEEEEFFFF0000ULL) F(sequence_number, 25)               \
  F(time_ns, 1700000001223456789LL) F(load_size_x_m, 3.5) F(load_size_y_m, 2.5)                    \
  F(load_size_z_m, 1.5) F(load_above_m, 0.5) F(margin_horizontal_m, 0.25)                          \
  F(margin_vertical_m, 0.3) F(sway_m, 0.15) F(braking_m, 0.8) F(max_age_s, 600)                    \
  Q(path, ClearancePose, 7, CLEARANCE_POSE)

#define CLEARANCE_REPLY(F, S, B, A, O, Q)                                                          \
  F(crane, 1) F(verdict, 2) F(client, 0xDDDDEEEEFFFF0000ULL) F(sequence_number, 25)                \
  F(time_ns, 1700000001323456789LL) F(map_id, 0xABCDEF0123456789ULL) F(revision, 26) F(reason, 6)  \
  F(has_safe_height, 1) F(slow_down, 1) F(zone, 27) F(safe_height_m, 3.375) F(safe_low_m, 3.25)    \
  F(safe_high_m, 5.5) F(first_x_m, 1.25)                                                           \
  F(first_y_m, -2.25) F(first_z_m, 0.875) F(oldest_age_s, -1) F(unknown_fraction, 0.0625)          \
  S(text, "no-go zone 27 'welding cell' at x 1.25, y -2.25, z 0.88 m")

#define DROP_COUNT(F, S, B, A, O, Q) S(cause, "cloud never arrived") F(count, 28 + (unsigned)k)
#define STAGE_TIME(F, S, B, A, O, Q)                                                               \
  S(stage, "integrate") F(count, 600 + (unsigned)k) F(p50_ms, 1.5) F(p99_ms, 2.5) F(max_ms, 3.5)
#define STATUS_FIGURE(F, S, B, A, O, Q)                                                            \
  S(name, "watch_tilt_x_rad") F(value, 0.25 * (double)k) F(sigma, 0.125)
#define SERVICE_STATUS(F, S, B, A, O, Q)                                                           \
  F(crane, 1) F(service, 4) F(sequence_number, 29) F(time_ns, 1700000001423456789LL)               \
  F(start_ns, 1690000000000000001LL) F(pid, 4711) F(status, 1) F(stream, 5000000003ULL)            \
  F(received, 30) F(published, 31) F(expected, 32) F(finished, 1) F(cpu_seconds, 12.5)             \
  F(memory_bytes, 6000000000ULL) Q(dropped, DropCount, 4, DROP_COUNT)                              \
  Q(stages, StageTime, 6, STAGE_TIME) Q(figures, StatusFigure, 5, STATUS_FIGURE)                    \
  S(version, "0.1.0") S(build_type, "Release")                 \
  S(message, "all well")

/* T(Type, topic, FIELDS, transient-local, depth, deadline ms, liveliness ms, exclusive) */
#define ALL_TOPICS(T)                                                          \
  T(StereoFrame, stereo_frame, STEREO_FRAME, 0, 8, 0, 0, 0)                       \
  T(RangefinderPosition, rangefinder_position, RANGEFINDER_POSITION, 0, 256, 200, 0, 0) \
  T(HoistState, hoist_state, HOIST_STATE, 0, 64, 300, 0, 0)                       \
  T(PartialCloud, partial_cloud, PARTIAL_CLOUD, 0, 4, 0, 0, 0)                    \
  T(MapTile, map_tile, MAP_TILE, 1, 1, 0, 0, 1)                                   \
  T(HeightTile, height_tile, HEIGHT_TILE, 1, 1, 0, 0, 1)                          \
  T(OctreeMap, octree_map, OCTREE_MAP, 1, 1, 0, 0, 1)                             \
  T(MapStatus, map_status, MAP_STATUS, 1, 1, 1000, 2000, 1)                       \
  T(TileRequest, tile_request, TILE_REQUEST, 0, 64, 0, 0, 0)                      \
  T(ZoneSet, zone_set, ZONE_SET, 1, 1, 0, 0, 1)                                   \
  T(ZoneCommand, zone_command, ZONE_COMMAND, 0, 64, 0, 0, 0)                      \
  T(ClearanceRequest, clearance_request, CLEARANCE_REQUEST, 0, 64, 0, 0, 0)       \
  T(ClearanceReply, clearance_reply, CLEARANCE_REPLY, 0, 64, 0, 0, 0)             \
  T(ServiceStatus, service_status, SERVICE_STATUS, 1, 1, 0, 0, 0)

#define BYTE_AT(i) ((unsigned char)((i) * 31 + 7))

#endif

// SPDX-License-Identifier: Apache-2.0
/* A peer on Eclipse Cyclone DDS that keeps the contract and lies: what it writes is what the mapper
 * wrote, under other keys, as another process.
 * usage: cyclone_liar tiles|ends|requests STRENGTH DOMAIN
 *   tiles     the mapper's own tiles again, at the ends of the world and beside its own
 *   ends      the mapper's tiles are written and ended
 *   requests  of one who holds nothing, a thousand a second
 * Exit code: 0 told all its lies, 2 usage, 3 Cyclone, 4 nothing of the mapper came. */
#include <dds/dds.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "height_tile.h"
#include "map_tile.h"
#include "tile_request.h"

static dds_entity_t g_participant;
static int32_t g_strength;

static dds_entity_t made(dds_entity_t entity, const char* what) {
  if (entity >= 0) return entity;
  fprintf(stderr, "%s: %s\n", what, dds_strretcode(-entity));
  exit(3);
}

static dds_qos_t* qos(bool map) {
  dds_qos_t* q = dds_create_qos();
  dds_qset_reliability(q, DDS_RELIABILITY_RELIABLE, DDS_SECS(1));
  dds_qset_durability(q, map ? DDS_DURABILITY_TRANSIENT_LOCAL : DDS_DURABILITY_VOLATILE);
  dds_qset_history(q, DDS_HISTORY_KEEP_LAST, map ? 1 : 64);
  if (map) {
    dds_qset_ownership(q, DDS_OWNERSHIP_EXCLUSIVE);
    dds_qset_ownership_strength(q, g_strength);
  }
  dds_qset_writer_data_lifecycle(q, false);
  return q;
}

static dds_entity_t topic_of(const dds_topic_descriptor_t* type, const char* name) {
  return made(dds_create_topic(g_participant, type, name, NULL, NULL), name);
}

static dds_qos_t* partition(void) {
  dds_qos_t* q = dds_create_qos();
  dds_qset_partition1(q, "crane_1");
  return q;
}

static dds_entity_t writer_of(const dds_topic_descriptor_t* type, const char* name, bool map) {
  const dds_entity_t publisher = made(dds_create_publisher(g_participant, partition(), NULL), name);
  return made(dds_create_writer(publisher, topic_of(type, name), qos(map), NULL), name);
}

/* The first sample of a topic; kept: this program is short. */
static const void* first_of(const dds_topic_descriptor_t* type, const char* name) {
  const dds_entity_t subscriber = made(dds_create_subscriber(g_participant, partition(), NULL), name);
  const dds_entity_t reader =
      made(dds_create_reader(subscriber, topic_of(type, name), qos(true), NULL), name);
  void* sample[1] = {NULL};
  dds_sample_info_t info;
  for (const dds_time_t end = dds_time() + DDS_SECS(15); dds_time() < end;
       dds_sleepfor(DDS_MSECS(10)))
    if (dds_take(reader, sample, &info, 1, 1) > 0 && info.valid_data) return sample[0];
  printf("%s: nothing came\n", name);
  exit(4);
}

static void wait_for_a_reader(dds_entity_t writer) {
  dds_publication_matched_status_t status = {0};
  for (const dds_time_t end = dds_time() + DDS_SECS(15); dds_time() < end;
       dds_sleepfor(DDS_MSECS(10)))
    if (dds_get_publication_matched_status(writer, &status) == DDS_RETCODE_OK &&
        status.current_count > 0)
      return;
}

static int lie_of_tiles(bool end) {
  crane_v1_MapTile voxels =
      *(const crane_v1_MapTile*)first_of(&crane_v1_MapTile_desc, "crane/v1/map_tile");
  crane_v1_HeightTile heights =
      *(const crane_v1_HeightTile*)first_of(&crane_v1_HeightTile_desc, "crane/v1/height_tile");
  const dds_entity_t v = writer_of(&crane_v1_MapTile_desc, "crane/v1/map_tile", true);
  const dds_entity_t h = writer_of(&crane_v1_HeightTile_desc, "crane/v1/height_tile", true);
  wait_for_a_reader(v);
  wait_for_a_reader(h);
  static const int16_t kEnds[][2] = {{-32768, -32768}, {32767, 32767}, {7, 7}};
  for (int round = 0; round < 20; ++round, dds_sleepfor(DDS_MSECS(50))) {
    if (!end)
      for (size_t i = 0; i < sizeof kEnds / sizeof *kEnds; ++i) {
        voxels.tile_x = heights.tile_x = kEnds[i][0];
        voxels.tile_y = heights.tile_y = kEnds[i][1];
        voxels.revision = heights.revision = UINT64_MAX - 100 + (uint64_t)round;
        if (dds_write(v, &voxels) < 0 || dds_write(h, &heights) < 0) return 3;
      }
    else if (dds_write(v, &voxels) < 0 || dds_dispose(v, &voxels) < 0 ||
             dds_write(h, &heights) < 0 || dds_dispose(h, &heights) < 0)
      return 3;
  }
  return 0;
}

static int ask_for_all(void) {
  const crane_v1_MapTile* tile = first_of(&crane_v1_MapTile_desc, "crane/v1/map_tile");
  const dds_entity_t w = writer_of(&crane_v1_TileRequest_desc, "crane/v1/tile_request", false);
  wait_for_a_reader(w);
  crane_v1_TileRequest request;
  memset(&request, 0, sizeof request);
  request.crane = 1;
  request.map_id = tile->map_id;
  memset(request.voxel_digests, 0x55, sizeof request.voxel_digests);
  memset(request.height_digests, 0x55, sizeof request.height_digests);
  for (int n = 0; n < 2000; ++n) {
    request.client = (uint64_t)n; /* another one each time, as it says */
    request.sequence_number = (uint64_t)n;
    request.time_ns = dds_time();
    if (dds_write(w, &request) < 0) return 3;
    if (n % 10 == 9) dds_sleepfor(DDS_MSECS(10));
  }
  return 0;
}

int main(int argc, char** argv) {
  setvbuf(stdout, NULL, _IOLBF, 0);
  if (argc != 4) {
    fprintf(stderr, "usage: cyclone_liar tiles|ends|requests STRENGTH DOMAIN\n");
    return 2;
  }
  g_strength = (int32_t)atoi(argv[2]);
  g_participant = made(dds_create_participant((uint32_t)atoi(argv[3]), NULL, NULL), "participant");
  const int code = strcmp(argv[1], "requests") == 0 ? ask_for_all()
                                                    : lie_of_tiles(strcmp(argv[1], "ends") == 0);
  dds_delete(g_participant);
  printf("%s: told\n", argv[1]);
  return code;
}

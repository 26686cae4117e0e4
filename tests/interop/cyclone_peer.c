// SPDX-License-Identifier: Apache-2.0
/* A peer on Eclipse Cyclone DDS, from the same IDL files by idlc, with none of our code.
 * usage: cyclone_peer check|ended|send TOPIC DOMAIN     one topic, field by field (samples.h);
 *                                                       ended: until its instance is disposed
 *        cyclone_peer follow DOMAIN               a living map: late join, zone, clearance
 * Exit code: 0 good, 1 a field differs (named), 2 usage, 4 nothing came. */
#include <dds/dds.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "clearance_reply.h"
#include "clearance_request.h"
#include "height_tile.h"
#include "hoist_state.h"
#include "map_status.h"
#include "map_tile.h"
#include "octree_map.h"
#include "partial_cloud.h"
#include "rangefinder_position.h"
#include "samples.h"
#include "service_status.h"
#include "stereo_frame.h"
#include "tile_request.h"
#include "zone_command.h"
#include "zone_set.h"

/* ---------------------------------------------------------------- fill and check */

#define FILL_F(f, v) s->f = (v);
#define FILL_S(f, v) fill_text(s->f, sizeof s->f, (v)); /* bounded strings are arrays */
#define FILL_B(f, n)                                        \
  s->f._buffer = malloc((n) * sizeof *s->f._buffer);                                 \
  s->f._length = s->f._maximum = (n);                       \
  s->f._release = true;                                     \
  for (size_t i = 0; i < (n); ++i) s->f._buffer[i] = BYTE_AT(i);
#define FILL_A(f, n, v) for (size_t i = 0; i < (n); ++i) s->f[i] = (v);
#define FILL_O(f, T, FIELDS) fill_##T(&s->f, 0);
#define FILL_Q(f, T, n, FIELDS)                           \
  s->f._buffer = calloc((n), sizeof *s->f._buffer);       \
  s->f._length = s->f._maximum = (n);                     \
  s->f._release = true;                                   \
  for (size_t q = 0; q < (n); ++q) fill_##T(&s->f._buffer[q], q);

static int g_wrong = 0;
static void differs(const char* type, const char* field) {
  if (++g_wrong <= 20) printf("%s.%s differs\n", type, field);
}
#define CHECK_F(f, v) \
  if (s->f != (v)) differs(type, #f);
#define CHECK_S(f, v) \
  if (strcmp(s->f, (v)) != 0) differs(type, #f);
#define CHECK_B(f, n)                                      \
  if (s->f._length != (n)) differs(type, #f ".length");    \
  for (size_t i = 0; i < (n) && i < s->f._length; ++i)     \
    if (s->f._buffer[i] != BYTE_AT(i)) differs(type, #f);
#define CHECK_A(f, n, v)            \
  for (size_t i = 0; i < (n); ++i) \
    if (s->f[i] != (v)) differs(type, #f);
#define CHECK_O(f, T, FIELDS) check_##T(&s->f, 0);
#define CHECK_Q(f, T, n, FIELDS)                        \
  if (s->f._length != (n)) differs(type, #f ".length"); \
  for (size_t q = 0; q < (n) && q < s->f._length; ++q) check_##T(&s->f._buffer[q], q);

static void fill_text(char* at, size_t size, const char* text) {
  memset(at, 0, size);
  strncpy(at, text, size - 1);
}

#define NESTED(T, FIELDS)                                                             \
  static void fill_##T(crane_v1_##T* s, size_t k) {                                   \
    (void)k;                                                                          \
    FIELDS(FILL_F, FILL_S, FILL_B, FILL_A, FILL_O, FILL_Q)                            \
  }                                                                                   \
  static void check_##T(const crane_v1_##T* s, size_t k) {                            \
    const char* type = #T;                                                            \
    (void)k;                                                                          \
    FIELDS(CHECK_F, CHECK_S, CHECK_B, CHECK_A, CHECK_O, CHECK_Q)                      \
  }
NESTED(ZoneCorner, ZONE_CORNER)
NESTED(Zone, ZONE)
NESTED(ClearancePose, CLEARANCE_POSE)
NESTED(DropCount, DROP_COUNT)
NESTED(StageTime, STAGE_TIME)
NESTED(StatusFigure, STATUS_FIGURE)
#define TOPIC_FUNCTIONS(T, topic, FIELDS, tl, depth, deadline, liveliness, exclusive) NESTED(T, FIELDS)
ALL_TOPICS(TOPIC_FUNCTIONS)

typedef struct {
  const char* name;
  const char* topic;
  const dds_topic_descriptor_t* descriptor;
  size_t size;
  void (*fill)(void*, size_t);
  void (*check)(const void*, size_t);
  int transient_local, depth, deadline_ms, liveliness_ms, exclusive;
} Topic;
#define ROW(T, topic, FIELDS, tl, depth, deadline, liveliness, exclusive)                        \
  {#topic,                                                                            \
   "crane/v1/" #topic,                                                                \
   &crane_v1_##T##_desc,                                                              \
   sizeof(crane_v1_##T),                                                              \
   (void (*)(void*, size_t))fill_##T,                                                 \
   (void (*)(const void*, size_t))check_##T,                                          \
   tl, depth, deadline, liveliness, exclusive},
static const Topic kTopics[] = {ALL_TOPICS(ROW)};

static const Topic* topic_named(const char* name) {
  for (size_t i = 0; i < sizeof kTopics / sizeof *kTopics; ++i)
    if (strcmp(kTopics[i].name, name) == 0) return &kTopics[i];
  return NULL;
}

/* ---------------------------------------------------------------- endpoints */

static dds_entity_t g_participant;

static dds_entity_t made(dds_entity_t entity, const char* what) {
  if (entity >= 0) return entity;
  fprintf(stderr, "%s: %s\n", what, dds_strretcode(-entity));
  exit(3);
}

static dds_qos_t* qos_of(const Topic* t) {
  dds_qos_t* q = dds_create_qos();
  dds_qset_reliability(q, DDS_RELIABILITY_RELIABLE, DDS_SECS(1));
  dds_qset_durability(q, t->transient_local ? DDS_DURABILITY_TRANSIENT_LOCAL : DDS_DURABILITY_VOLATILE);
  dds_qset_history(q, DDS_HISTORY_KEEP_LAST, t->depth);
  if (t->exclusive) dds_qset_ownership(q, DDS_OWNERSHIP_EXCLUSIVE);
  if (t->deadline_ms > 0) dds_qset_deadline(q, DDS_MSECS(t->deadline_ms));
  if (t->liveliness_ms > 0) dds_qset_liveliness(q, DDS_LIVELINESS_AUTOMATIC, DDS_MSECS(t->liveliness_ms));
  return q;
}

static dds_qos_t* partition(void) {
  dds_qos_t* q = dds_create_qos();
  dds_qset_partition1(q, "crane_1");
  return q;
}

static dds_entity_t reader_of(const char* name) {
  const Topic* t = topic_named(name);
  const dds_entity_t topic =
      made(dds_create_topic(g_participant, t->descriptor, t->topic, NULL, NULL), t->topic);
  const dds_entity_t subscriber = made(dds_create_subscriber(g_participant, partition(), NULL), name);
  return made(dds_create_reader(subscriber, topic, qos_of(t), NULL), name);
}

static dds_entity_t writer_of(const char* name) {
  const Topic* t = topic_named(name);
  const dds_entity_t topic =
      made(dds_create_topic(g_participant, t->descriptor, t->topic, NULL, NULL), t->topic);
  const dds_entity_t publisher = made(dds_create_publisher(g_participant, partition(), NULL), name);
  return made(dds_create_writer(publisher, topic, qos_of(t), NULL), name);
}

static int check(const Topic* t, bool until_disposed) {
  const dds_entity_t reader = reader_of(t->name);
  const dds_time_t end = dds_time() + DDS_SECS(15);
  while (dds_time() < end) {
    void* sample[1] = {NULL};
    dds_sample_info_t info;
    const bool any = dds_take(reader, sample, &info, 1, 1) > 0;
    if (any && until_disposed && info.instance_state == DDS_IST_NOT_ALIVE_DISPOSED) {
      printf("%s: disposed\n", t->name);
      return 0;
    }
    if (any && until_disposed && info.valid_data) printf("%s: alive\n", t->name);
    if (any && !until_disposed && info.valid_data) {
      t->check(sample[0], 0);
      printf("%s: %s\n", t->name, g_wrong == 0 ? "every field is right" : "WRONG");
      return g_wrong == 0 ? 0 : 1;
    }
    dds_sleepfor(DDS_MSECS(5));
  }
  printf("%s: nothing came\n", t->name);
  return 4;
}

/* Again and again until it is ended. */
static int send_samples(const Topic* t) {
  const dds_entity_t writer = writer_of(t->name);
  void* sample = calloc(1, t->size);
  t->fill(sample, 0);
  for (int n = 0; n < 300; ++n) {
    if (dds_write(writer, sample) != DDS_RETCODE_OK) return 3;
    dds_sleepfor(DDS_MSECS(50));
  }
  return 0;
}

/* ---------------------------------------------------------------- a living map */

static uint64_t tile_digest(int16_t x, int16_t y, int16_t z, uint32_t crc) { /* idl/README.md */
  uint64_t h = (uint64_t)(uint16_t)x << 32 | (uint64_t)(uint16_t)y << 16 | (uint16_t)z;
  const uint64_t add[2] = {0x9E3779B97F4A7C15ULL, crc};
  for (int i = 0; i < 2; ++i) {
    h += add[i];
    h = (h ^ h >> 30) * 0xBF58476D1CE4E5B9ULL;
    h = (h ^ h >> 27) * 0x94D049BB133111EBULL;
    h ^= h >> 31;
  }
  return h;
}

/* Keep-last 1 readers, read and not taken: their instances are the map. */
static uint64_t digest_of(dds_entity_t reader, bool heights, uint64_t map_id, uint32_t* tiles) {
  enum { kMost = 4096 };
  static void* samples[kMost];
  static dds_sample_info_t infos[kMost];
  memset(samples, 0, sizeof samples);
  uint64_t digest = 0;
  *tiles = 0;
  const int n = dds_read(reader, samples, infos, kMost, kMost);
  for (int i = 0; i < n; ++i) {
    if (!infos[i].valid_data || infos[i].instance_state != DDS_IST_ALIVE) continue;
    if (heights) {
      const crane_v1_HeightTile* t = samples[i];
      if (t->map_id != map_id) continue;
      digest += tile_digest(t->tile_x, t->tile_y, 0, t->crc32c);
    } else {
      const crane_v1_MapTile* t = samples[i];
      if (t->map_id != map_id) continue;
      digest += tile_digest(t->tile_x, t->tile_y, t->tile_z, t->crc32c);
    }
    ++*tiles;
  }
  if (n > 0) dds_return_loan(reader, samples, n);
  return digest;
}

/* Takes the newest sample; false when there is none. The loan is kept: this program is short. */
static bool newest(dds_entity_t reader, const void** out) {
  bool any = false;
  void* sample[1] = {NULL};
  dds_sample_info_t info;
  while (sample[0] = NULL, dds_take(reader, sample, &info, 1, 1) > 0)
    if (info.valid_data) *out = sample[0], any = true;
  return any;
}

static int follow(void) {
  const dds_entity_t voxels = reader_of("map_tile");
  const dds_entity_t heights = reader_of("height_tile");
  const dds_entity_t octree = reader_of("octree_map");
  const dds_entity_t statuses = reader_of("map_status");
  const dds_entity_t zone_sets = reader_of("zone_set");
  const dds_entity_t replies = reader_of("clearance_reply");
  const dds_entity_t commands = writer_of("zone_command");
  const dds_entity_t requests = writer_of("clearance_request");
  const void *status_at = NULL, *zones_at = NULL, *reply_at = NULL, *octree_at = NULL;
  const dds_time_t end = dds_time() + DDS_SECS(30);
  bool complete = false, zoned = false;
  uint64_t asked = 0;
  for (int round = 0; dds_time() < end; ++round, dds_sleepfor(DDS_MSECS(20))) {
    newest(statuses, &status_at);
    newest(zone_sets, &zones_at);
    newest(octree, &octree_at);
    const crane_v1_MapStatus* status = status_at;
    if (status == NULL) continue;
    if (!complete) {
      uint32_t voxel_tiles = 0, height_tiles = 0;
      const uint64_t v = digest_of(voxels, false, status->map_id, &voxel_tiles);
      const uint64_t h = digest_of(heights, true, status->map_id, &height_tiles);
      complete = voxel_tiles > 0 && voxel_tiles == status->voxel_tiles && v == status->voxel_digest &&
                 height_tiles == status->height_tiles && h == status->height_digest;
      if (complete)
        printf("complete: %u voxel tiles, %u height tiles, digests equal\n", voxel_tiles, height_tiles);
      continue;
    }
    if (round % 10 == 0 && !zoned) { /* the same command until it shows */
      static crane_v1_ZoneCommand command;
      if (command.crane == 0) fill_ZoneCommand(&command, 0);
      command.zone.kind = crane_v1_ZONE_SLOW_DOWN;
      if (dds_write(commands, &command) != DDS_RETCODE_OK) return 3;
    }
    const crane_v1_ZoneSet* zones = zones_at;
    if (!zoned && zones != NULL)
      for (uint32_t i = 0; i < zones->zones._length; ++i)
        if (zones->zones._buffer[i].id == 22 && zones->zones._buffer[i].corners._length == 5 &&
            strcmp(zones->zones._buffer[i].name, "welding cell") == 0)
          zoned = true, printf("zone set: revision %llu\n", (unsigned long long)zones->revision);
    if (!zoned) continue;
    if (round % 10 == 0) {
      static crane_v1_ClearanceRequest request;
      if (request.crane == 0) fill_ClearanceRequest(&request, 0);
      request.sequence_number = ++asked;
      request.time_ns = dds_time();
      if (dds_write(requests, &request) != DDS_RETCODE_OK) return 3;
    }
    newest(replies, &reply_at);
    const crane_v1_ClearanceReply* reply = reply_at;
    if (reply == NULL || reply->client != 0xDDDDEEEEFFFF0000ULL ||
        reply->verdict == crane_v1_VERDICT_INVALID)
      continue;
    printf("clearance: verdict %u, reason %u: %s\n", reply->verdict, reply->reason, reply->text);
    const crane_v1_OctreeMap* tree = octree_at;
    printf("octree: %u bytes\n", tree != NULL ? tree->payload._length : 0);
    return tree != NULL && tree->payload._length > 0 ? 0 : 1;
  }
  printf("gave up: complete %d, zone %d, asked %llu\n", complete, zoned, (unsigned long long)asked);
  return 4;
}

int main(int argc, char** argv) {
  setvbuf(stdout, NULL, _IOLBF, 0);
  const bool following = argc == 3 && strcmp(argv[1], "follow") == 0;
  const Topic* topic = argc == 4 ? topic_named(argv[2]) : NULL;
  if (!following && topic == NULL) {
    fprintf(stderr, "usage: cyclone_peer check|ended|send TOPIC DOMAIN | follow DOMAIN\n");
    return 2;
  }
  g_participant = made(dds_create_participant((uint32_t)atoi(argv[argc - 1]), NULL, NULL), "participant");
  const int code = following                         ? follow()
                   : strcmp(argv[1], "check") == 0 ? check(topic, false)
                   : strcmp(argv[1], "ended") == 0 ? check(topic, true)
                                                   : send_samples(topic);
  dds_delete(g_participant);
  return code;
}

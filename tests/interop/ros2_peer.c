// SPDX-License-Identifier: Apache-2.0
/* What an RViz2 on another vendor's DDS gets: reads the mirror's topics by ROS 2's names and types.
 * usage: ros2_peer DOMAIN       Exit code: 0 every topic came and makes sense, 1 not, 4 something did not come. */
#include <dds/dds.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "ros2.h"

static bool good_points(const void* p) {
  const sensor_msgs_msg_dds__PointCloud2_* m = p;
  printf("points: %ux%u in %s\n", m->width, m->height, m->header.frame_id);
  return m->fields._length == 4 && strcmp(m->fields._buffer[0].name, "x") == 0 && m->point_step == 16 &&
         m->data._length == m->row_step * m->height && m->row_step == m->width * m->point_step;
}
static bool good_heights(const void* p) {
  const sensor_msgs_msg_dds__PointCloud2_* m = p;
  printf("heights: %u points in %s\n", m->width, m->header.frame_id);
  return m->fields._length == 3 && m->width > 1000 && m->data._length == 12 * m->width && m->is_dense;
}
static bool good_image(const void* p) {
  const sensor_msgs_msg_dds__Image_* m = p;
  printf("image: %ux%u %s\n", m->width, m->height, m->encoding);
  return strcmp(m->encoding, "bgr8") == 0 && m->data._length == 3 * m->width * m->height;
}
static bool good_info(const void* p) {
  const sensor_msgs_msg_dds__CameraInfo_* m = p;
  printf("camera_info: f %.1f\n", m->k[0]);
  return m->k[0] > 100 && m->k[8] == 1 && strcmp(m->distortion_model, "plumb_bob") == 0 && m->d._length == 5;
}
static bool good_octomap(const void* p) {
  const octomap_msgs_msg_dds__Octomap_* m = p;
  printf("octomap: %s, %.3f m, %u bytes\n", m->id, m->resolution, m->data._length);
  return m->binary && strcmp(m->id, "OcTree") == 0 && m->data._length > 100;
}
static bool good_grid(const void* p) {
  const nav_msgs_msg_dds__OccupancyGrid_* m = p;
  unsigned count[3] = {0, 0, 0};
  for (uint32_t i = 0; i < m->data._length; ++i)
    ++count[(int8_t)m->data._buffer[i] < 0 ? 0 : m->data._buffer[i] == 0 ? 1 : 2];
  printf("grid: %ux%u, %u unknown, %u floor, %u obstacle\n", m->info.width, m->info.height, count[0], count[1], count[2]);
  return m->data._length == m->info.width * m->info.height && count[0] > 0 && count[1] > 0 && count[2] > 0 &&
         m->info.origin.orientation.w == 1;
}
static bool good_tf(const void* p) {
  const tf2_msgs_msg_dds__TFMessage_* m = p;
  if (m->transforms._length == 0) return false;
  const geometry_msgs_msg_dds__TransformStamped_* t = &m->transforms._buffer[0];
  printf("tf: %s -> %s at (%.2f, %.2f)\n", t->header.frame_id, t->child_frame_id, t->transform.translation.x,
         t->transform.translation.y);
  return strcmp(t->header.frame_id, "map") == 0 && strcmp(t->child_frame_id, "crane_1/gantry") == 0;
}
static bool good_tf_static(const void* p) {
  const tf2_msgs_msg_dds__TFMessage_* m = p;
  printf("tf_static: %u transforms\n", m->transforms._length);
  if (m->transforms._length == 0) return false;
  const geometry_msgs_msg_dds__TransformStamped_* t = &m->transforms._buffer[0];
  return t->transform.translation.z > 1 && strcmp(t->child_frame_id, "crane_1/camera") == 0;
}
static bool good_diagnostics(const void* p) {
  const diagnostic_msgs_msg_dds__DiagnosticArray_* m = p;
  for (uint32_t i = 0; i < m->status._length; ++i)
    if (strcmp(m->status._buffer[i].name, "cranemap: mapper") == 0)
      return printf("diagnostics: %u entries\n", m->status._length), true;
  return false;
}

typedef struct {
  const char* topic;
  const dds_topic_descriptor_t* type;
  bool transient_local;
  bool (*good)(const void*);
  dds_entity_t reader;
  bool came, right;
} Row;

int main(int argc, char** argv) {
  setvbuf(stdout, NULL, _IOLBF, 0);
  if (argc != 2) return 2;
  Row rows[] = {
      {"rt/crane_1/points", &sensor_msgs_msg_dds__PointCloud2__desc, false, good_points, 0, false, false},
      {"rt/crane_1/heights", &sensor_msgs_msg_dds__PointCloud2__desc, true, good_heights, 0, false, false},
      {"rt/crane_1/image_raw", &sensor_msgs_msg_dds__Image__desc, false, good_image, 0, false, false},
      {"rt/crane_1/camera_info", &sensor_msgs_msg_dds__CameraInfo__desc, false, good_info, 0, false, false},
      {"rt/crane_1/octomap_binary", &octomap_msgs_msg_dds__Octomap__desc, true, good_octomap, 0, false, false},
      {"rt/crane_1/occupancy_grid", &nav_msgs_msg_dds__OccupancyGrid__desc, true, good_grid, 0, false, false},
      {"rt/tf", &tf2_msgs_msg_dds__TFMessage__desc, false, good_tf, 0, false, false},
      {"rt/tf_static", &tf2_msgs_msg_dds__TFMessage__desc, true, good_tf_static, 0, false, false},
      {"rt/diagnostics", &diagnostic_msgs_msg_dds__DiagnosticArray__desc, false, good_diagnostics, 0, false, false},
  };
  enum { kRows = sizeof rows / sizeof *rows };
  const dds_entity_t participant = dds_create_participant((uint32_t)atoi(argv[1]), NULL, NULL);
  for (int i = 0; i < kRows; ++i) {
    dds_qos_t* q = dds_create_qos();
    dds_qset_reliability(q, DDS_RELIABILITY_RELIABLE, DDS_SECS(1));
    dds_qset_durability(q, rows[i].transient_local ? DDS_DURABILITY_TRANSIENT_LOCAL : DDS_DURABILITY_VOLATILE);
    dds_qset_history(q, DDS_HISTORY_KEEP_LAST, 5);
    const dds_entity_t topic = dds_create_topic(participant, rows[i].type, rows[i].topic, NULL, NULL);
    rows[i].reader = dds_create_reader(participant, topic, q, NULL);
    if (rows[i].reader < 0) {
      fprintf(stderr, "%s: %s\n", rows[i].topic, dds_strretcode(-rows[i].reader));
      return 3;
    }
  }
  const dds_time_t end = dds_time() + DDS_SECS(25);
  int right = 0;
  while (right < kRows && dds_time() < end) {
    for (int i = 0; i < kRows; ++i) {
      void* sample[1] = {NULL};
      dds_sample_info_t info;
      if (dds_take(rows[i].reader, sample, &info, 1, 1) <= 0) continue;
      if (info.valid_data && !rows[i].right) {
        rows[i].came = true;
        rows[i].right = rows[i].good(sample[0]);
        right += rows[i].right ? 1 : 0;
      }
      dds_return_loan(rows[i].reader, sample, 1);
    }
    dds_sleepfor(DDS_MSECS(5));
  }
  int code = 0;
  for (int i = 0; i < kRows; ++i)
    if (!rows[i].right) {
      printf("%s: %s\n", rows[i].topic, rows[i].came ? "WRONG" : "nothing came");
      code = rows[i].came ? 1 : 4;
    }
  dds_delete(participant);
  return code;
}

// SPDX-License-Identifier: Apache-2.0
/* A camera driver without our code: Eclipse Cyclone DDS and what idlc makes of idl/v1/stereo_frame.idl.
 * Two grey pictures (PGM) stand for the camera, 10 times a second.
 * usage: camera_driver_cyclone LEFT.pgm RIGHT.pgm [DOMAIN [FRAMES]] */
#include <dds/dds.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

#include "stereo_frame.h"

static int grab(const char* file, crane_v1_StereoFrame* s, dds_sequence_octet* out) {
  FILE* f = fopen(file, "rb");
  int good = f && fscanf(f, "P5 %u %u 255", &s->width, &s->height) == 2 && fgetc(f) != EOF;
  out->_length = out->_maximum = good ? s->width * s->height : 0;
  out->_buffer = malloc(out->_length + 1);
  good = good && fread(out->_buffer, 1, out->_length, f) == out->_length;
  if (f) fclose(f);
  return good;
}

int main(int argc, char** argv) {
  static crane_v1_StereoFrame frame; /* zeros */
  dds_sequence_octet left = {0}, right = {0};
  if (argc < 3 || !grab(argv[1], &frame, &left) || !grab(argv[2], &frame, &right) ||
      left._length != right._length)
    return fprintf(stderr, "usage: %s LEFT.pgm RIGHT.pgm [DOMAIN [FRAMES]]\n", argv[0]), 2;
  frame.left._buffer = left._buffer, frame.left._length = frame.left._maximum = left._length;
  frame.right._buffer = right._buffer, frame.right._length = frame.right._maximum = right._length;
  frame.crane = 1;
  frame.encoding = crane_v1_ENCODING_MONO8;
  frame.stream = (uint64_t)dds_time(); /* another one at each start */
  frame.after = -1;

  /* The QoS of the topic table in idl/README.md; the crane's number is its partition. */
  const dds_entity_t participant = dds_create_participant(argc > 3 ? (dds_domainid_t)atoi(argv[3]) : 0, NULL, NULL);
  dds_qos_t* qos = dds_create_qos();
  dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, DDS_SECS(1));
  dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, 8);
  dds_qset_lifespan(qos, DDS_SECS(2));
  dds_qos_t* partition = dds_create_qos();
  dds_qset_partition1(partition, "crane_1");
  const dds_entity_t topic =
      dds_create_topic(participant, &crane_v1_StereoFrame_desc, "crane/v1/stereo_frame", NULL, NULL);
  const dds_entity_t publisher = dds_create_publisher(participant, partition, NULL);
  const dds_entity_t writer = dds_create_writer(publisher, topic, qos, NULL);
  if (writer < 0) return fprintf(stderr, "%s\n", dds_strretcode(-writer)), 3;

  for (long n = argc > 4 ? atol(argv[4]) : -1; n != 0; --n, ++frame.sequence_number) {
    dds_sleepfor(DDS_MSECS(100)); /* the next exposure */
    frame.exposure_time_ns = dds_time();
    if (dds_write(writer, &frame) != DDS_RETCODE_OK) fprintf(stderr, "not accepted\n");
  }
  dds_delete(participant);
}

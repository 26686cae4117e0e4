// SPDX-License-Identifier: Apache-2.0
// A map within a participant that the program has already.

#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <gtest/gtest.h>

#include <atomic>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/domain/DomainParticipantListener.hpp>
#include <fastdds/dds/domain/qos/DomainParticipantFactoryQos.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>

#include "client_fixture.hpp"
#include "map_tilePubSubTypes.h"

namespace crane {
namespace {

using namespace std::chrono_literals;
namespace fdds = eprosima::fastdds::dds;
using ReturnCode = eprosima::fastrtps::types::ReturnCode_t;

/// Of a program that listens to all that goes on in its participant.
class NosyListener final : public fdds::DomainParticipantListener {
 public:
  std::atomic<int> heard{0};
  void on_data_on_readers(fdds::Subscriber* /*subscriber*/) override { ++heard; }
  void on_data_available(fdds::DataReader* /*reader*/) override { ++heard; }
  void on_subscription_matched(fdds::DataReader* /*reader*/,
                               const fdds::SubscriptionMatchedStatus& /*status*/) override {
    ++heard;
  }
  void on_publication_matched(fdds::DataWriter* /*writer*/,
                              const fdds::PublicationMatchedStatus& /*status*/) override {
    ++heard;
  }
};

class HostedMapTest : public test::ClientFixture {
 protected:
  HostedMapTest() { host_ = make_host(); }
  ~HostedMapTest() override {
    if (host_ == nullptr) return;
    host_->set_listener(nullptr);
    host_->delete_contained_entities();
    factory().delete_participant(host_);
  }

  static fdds::DomainParticipantFactory& factory() {
    return *fdds::DomainParticipantFactory::get_instance();
  }
  /// As a program makes it that knows nothing of us: loopback only.
  fdds::DomainParticipant* make_host() {
    fdds::DomainParticipantQos qos;
    auto udp = std::make_shared<eprosima::fastdds::rtps::UDPv4TransportDescriptor>();
    udp->interfaceWhiteList = {"127.0.0.1"};
    qos.transport().use_builtin_transports = false;
    qos.transport().user_transports.push_back(udp);
    qos.name("host");
    return factory().create_participant(test::settings().domain, qos, &listener_,
                                        fdds::StatusMask::all());
  }
  std::unique_ptr<client::Map> join_host(std::uint32_t crane = 1) {
    client::MapOptions options;
    options.crane = crane;
    return client::Map::join(*host_, options, error_);
  }

  /// Nothing of ours is in it any more: Fast DDS deletes it, as it does not while there is a
  /// publisher, a subscriber or a topic.
  void expect_empty_host() {
    EXPECT_EQ(host_->lookup_topicdescription("crane/v1/map_tile"), nullptr);
    for (const char* type : {"MapTile", "HeightTile", "MapStatus", "ZoneSet", "TileRequest"})
      EXPECT_TRUE(host_->find_type(std::string("crane::v1::") + type).empty()) << type;
    EXPECT_EQ(factory().delete_participant(host_), ReturnCode::RETCODE_OK);
    host_ = nullptr;
  }

  NosyListener listener_;
  fdds::DomainParticipant* host_ = nullptr;
  std::string error_;
};

TEST_F(HostedMapTest, FollowsAndLeavesTheParticipantAsItWas) {
  ASSERT_NE(host_, nullptr);
  put({0, 0}, 0.5);
  publish();
  const fdds::DomainParticipantQos before = host_->get_qos();
  {
    const auto map = join_host();
    ASSERT_NE(map, nullptr) << error_;
    ASSERT_TRUE(map->wait_until_complete(10s)) << map->status().reason;
    EXPECT_NEAR(map->height(0.1, 0.1).height_m, 0.5, 1e-3);
    put({1, 0}, 0.8);
    publish();
    EXPECT_TRUE(test::eventually([&] { return map->height(1.7, 0.1).height_m > 0.7; }));
    EXPECT_EQ(host_->get_listener(), &listener_);
    EXPECT_TRUE(host_->get_qos() == before);
  }
  EXPECT_EQ(listener_.heard, 0);
  expect_empty_host();
}

TEST_F(HostedMapTest, AParticipantCannotBeDeletedWhileItsMapIsThere) {
  const auto map = join_host();
  ASSERT_NE(map, nullptr) << error_;
  EXPECT_EQ(factory().delete_participant(host_), ReturnCode::RETCODE_PRECONDITION_NOT_MET);
  put({0, 0}, 0.5);
  publish();
  EXPECT_TRUE(map->wait_until_complete(10s)) << map->status().reason;
}

TEST_F(HostedMapTest, AParticipantThatEndedFirstMakesTheMapInvalidAndSaysSo) {
  put({0, 0}, 0.5);
  publish();
  auto map = join_host();
  ASSERT_NE(map, nullptr) << error_;
  ASSERT_TRUE(map->wait_until_complete(10s));
  // Its readers may just be in use: then Fast DDS refuses.
  ASSERT_TRUE(test::eventually(
      [&] { return host_->delete_contained_entities() == ReturnCode::RETCODE_OK; }));
  ASSERT_EQ(factory().delete_participant(host_), ReturnCode::RETCODE_OK);
  host_ = make_host();  // perhaps where the other was
  EXPECT_TRUE(test::eventually(
      [&] { return map->status().reason.find("ended before") != std::string::npos; }));
  EXPECT_FALSE(map->status().valid);
  EXPECT_FALSE(map->status().alive);
  EXPECT_EQ(map->clearance({}).reason, client::Reason::kMapInvalid);
  map.reset();
  const auto again = join_host();
  ASSERT_NE(again, nullptr) << error_;
  EXPECT_TRUE(again->wait_until_complete(10s));
}

TEST_F(HostedMapTest, TwoMapsWithinOneParticipantEndOnTheirOwn) {
  auto one = join_host();
  ASSERT_NE(one, nullptr) << error_;
  const auto two = join_host();
  ASSERT_NE(two, nullptr) << error_;
  const auto of_another_crane = join_host(2);
  ASSERT_NE(of_another_crane, nullptr) << error_;
  put({0, 0}, 0.5);
  publish();
  EXPECT_TRUE(one->wait_until_complete(10s));
  EXPECT_TRUE(two->wait_until_complete(10s));
  one.reset();
  put({0, 0}, 0.9);
  publish();
  EXPECT_TRUE(test::eventually([&] { return two->height(0.1, 0.1).height_m > 0.8; }));
  EXPECT_FALSE(of_another_crane->status().heard);
}

TEST_F(HostedMapTest, ATypeOfTheHostsOwnIsRefused) {
  fdds::TypeSupport type(new v1::MapTilePubSubType());
  ASSERT_EQ(type.register_type(host_), ReturnCode::RETCODE_OK);
  EXPECT_EQ(join_host(), nullptr);
  EXPECT_NE(error_.find("'crane::v1::MapTile' of its own"), std::string::npos) << error_;
  EXPECT_EQ(host_->unregister_type("crane::v1::MapTile"), ReturnCode::RETCODE_OK);
  expect_empty_host();  // also of the join that failed
}

TEST_F(HostedMapTest, AParticipantThatIsNotEnabledIsRefused) {
  fdds::DomainParticipantFactoryQos usual;
  factory().get_qos(usual);
  fdds::DomainParticipantFactoryQos manual = usual;
  manual.entity_factory().autoenable_created_entities = false;
  factory().set_qos(manual);
  fdds::DomainParticipant* asleep = make_host();
  factory().set_qos(usual);
  ASSERT_NE(asleep, nullptr);
  std::swap(asleep, host_);
  EXPECT_EQ(join_host(), nullptr);
  EXPECT_NE(error_.find("is not enabled"), std::string::npos) << error_;
  std::swap(asleep, host_);
  EXPECT_EQ(factory().delete_participant(asleep), ReturnCode::RETCODE_OK);
}

}  // namespace
}  // namespace crane

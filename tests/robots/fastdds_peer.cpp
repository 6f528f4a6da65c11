// A peer with Fast DDS: waits for one message of a latched topic of ROS 2, and prints its size.
//
//   fastdds_peer DOMAIN TOPIC TYPE [localhost]
//
// `localhost` is what rmw_fastrtps of Humble makes of ROS_LOCALHOST_ONLY=1. The message stays as
// bytes, so that any type can be read without generated code.

#include <chrono>
#include <cstdlib>
#include <cstring>
#include <iostream>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/TopicDataType.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>

using namespace eprosima::fastdds::dds;
using eprosima::fastrtps::rtps::InstanceHandle_t;
using eprosima::fastrtps::rtps::SerializedPayload_t;
using Bytes = std::vector<unsigned char>;

class RawType : public TopicDataType {
public:
  explicit RawType(const std::string& name) {
    setName(name.c_str());
    m_typeSize = 1 << 16;
    m_isGetKeyDefined = false;
  }
  bool serialize(void*, SerializedPayload_t*) override { return false; }
  bool deserialize(SerializedPayload_t* payload, void* data) override {
    static_cast<Bytes*>(data)->assign(payload->data, payload->data + payload->length);
    return true;
  }
  std::function<uint32_t()> getSerializedSizeProvider(void*) override {
    return [] { return 0u; };
  }
  void* createData() override { return new Bytes; }
  void deleteData(void* data) override { delete static_cast<Bytes*>(data); }
  bool getKey(void*, InstanceHandle_t*, bool) override { return false; }
};

int main(int argc, char** argv) {
  if (argc < 4) return 2;
  DomainParticipantQos participant_qos;
  if (argc > 4 && std::strcmp(argv[4], "localhost") == 0) {
    auto udp = std::make_shared<eprosima::fastdds::rtps::UDPv4TransportDescriptor>();
    udp->interfaceWhiteList.push_back("127.0.0.1");
    participant_qos.transport().user_transports.push_back(udp);
    participant_qos.transport().use_builtin_transports = false;
  }
  auto* participant = DomainParticipantFactory::get_instance()->create_participant(
      std::atoi(argv[1]), participant_qos);
  TypeSupport type(new RawType(argv[3]));
  type.register_type(participant);
  auto* topic = participant->create_topic(argv[2], argv[3], TOPIC_QOS_DEFAULT);
  auto* subscriber = participant->create_subscriber(SUBSCRIBER_QOS_DEFAULT);
  DataReaderQos reader_qos;
  reader_qos.reliability().kind = RELIABLE_RELIABILITY_QOS;
  reader_qos.durability().kind = TRANSIENT_LOCAL_DURABILITY_QOS;
  auto* reader = subscriber->create_datareader(topic, reader_qos);
  const auto begin = std::chrono::steady_clock::now();
  for (;;) {
    Bytes bytes;
    SampleInfo info;
    if (reader->take_next_sample(&bytes, &info) == ReturnCode_t::RETCODE_OK && info.valid_data) {
      const std::chrono::duration<double> waited = std::chrono::steady_clock::now() - begin;
      std::cout << bytes.size() << " bytes after " << waited.count() << " s" << std::endl;
      std::_Exit(0);
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
}

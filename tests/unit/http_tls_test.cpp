// SPDX-License-Identifier: Apache-2.0
// TLS as others speak it: certificates by openssl, requests by curl.

#include <gtest/gtest.h>
#include <sys/wait.h>

#include <array>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <string>

#include "http/server.hpp"
#include "temp_folder.hpp"

namespace crane::http {
namespace {

struct Said {
  int code = -1;
  std::string text;
};

Said run(const std::string& command) {
  Said out;
  FILE* pipe = popen((command + " 2>&1").c_str(), "r");
  if (pipe == nullptr) return out;
  std::array<char, 4096> some{};
  while (const std::size_t n = fread(some.data(), 1, some.size(), pipe))
    out.text.append(some.data(), n);
  const int ended = pclose(pipe);
  out.code = WIFEXITED(ended) ? WEXITSTATUS(ended) : -1;
  return out;
}

class Tls : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new test::TempFolder;
    make_ca("ca");
    make_ca("other-ca");
    make_identity("server", "ca", "-addext subjectAltName=IP:127.0.0.1");
    make_identity("client", "ca", "");
    make_identity("stranger", "other-ca", "");
  }
  static void TearDownTestSuite() { delete folder_; }

  static std::string path(const std::string& name) { return *folder_ / name; }
  static std::string key_and_request(const std::string& name) {
    return "openssl req -newkey ec -pkeyopt ec_paramgen_curve:P-256 -nodes -keyout " +
           path(name + ".key") + " -subj /CN=" + name;
  }
  static void must(const std::string& command) {
    const Said said = run("umask 077; " + command);
    ASSERT_EQ(said.code, 0) << command << "\n" << said.text;
  }
  static void make_ca(const std::string& name) {
    must(key_and_request(name) + " -x509 -days 2 -out " + path(name + ".pem"));
  }
  static void make_identity(const std::string& name, const std::string& ca,
                            const std::string& more) {
    must(key_and_request(name) + " " + more + " -out " + path(name + ".csr"));
    must("openssl x509 -req -copy_extensions copy -days 1 -in " + path(name + ".csr") + " -CA " +
         path(ca + ".pem") + " -CAkey " + path(ca + ".key") + " -CAcreateserial -out " +
         path(name + ".pem"));
  }

  static TlsFiles files(bool client_ca = false) {
    return {path("server.pem"), path("server.key"), client_ca ? path("ca.pem") : ""};
  }
  static std::unique_ptr<Server> serve(const TlsFiles& tls) {
    Router router({{"/x", [] { return Response{200, "answered"}; }}}, {});
    Limits limits;
    limits.deadline = std::chrono::seconds(20);
    limits.answer_deadline = std::chrono::seconds(20);
    auto server = Server::start("127.0.0.1", 0, std::move(router), limits, tls);
    EXPECT_TRUE(server) << server.error().text();
    return server ? std::move(*server) : nullptr;
  }
  static Said curl(const Server& server, const std::string& scheme, const std::string& more) {
    return run("timeout 30 curl -sS --noproxy '*' " + more + " " + scheme +
               "://127.0.0.1:" + std::to_string(server.port()) + "/x");
  }
  static std::string as(const std::string& name) {
    return " --cert " + path(name + ".pem") + " --key " + path(name + ".key");
  }
  static Error refused(const TlsFiles& tls) {
    auto server = Server::start("127.0.0.1", 0, Router({}, {}), {}, tls);
    EXPECT_FALSE(server);
    return server ? Error{} : server.error();
  }

  static test::TempFolder* folder_;
};
test::TempFolder* Tls::folder_ = nullptr;

TEST_F(Tls, IsSpokenToWhoKnowsTheCaAndNobodyElse) {
  const auto server = serve(files());
  const std::string ca = "--cacert " + path("ca.pem");
  for (const char* version : {"--tlsv1.2 --tls-max 1.2", "--tlsv1.3"})
    EXPECT_EQ(curl(*server, "https", ca + " " + version).text, "answered") << version;
  const Said wrong_ca = curl(*server, "https", "--cacert " + path("other-ca.pem"));
  EXPECT_EQ(wrong_ca.code, 60) << wrong_ca.text;
  EXPECT_NE(curl(*server, "https", ca + " --tls-max 1.1 --ciphers DEFAULT@SECLEVEL=0").code, 0);
}

TEST_F(Tls, TellsWhoSpeaksInTheClear) {
  const auto server = serve(files());
  const Said said = curl(*server, "http", "-i");
  EXPECT_TRUE(said.text.starts_with("HTTP/1.1 400")) << said.text;
  EXPECT_NE(said.text.find("ask by https://"), std::string::npos) << said.text;
  EXPECT_EQ(curl(*server, "https", "--cacert " + path("ca.pem")).text, "answered") << "and goes on";
  EXPECT_GE(server->counts().refused, 1U);
}

TEST_F(Tls, AsksForAClientsCertificateOfTheRightCa) {
  const auto server = serve(files(true));
  const std::string ca = "--cacert " + path("ca.pem");
  EXPECT_EQ(curl(*server, "https", ca + as("client")).text, "answered");
  for (const char* version : {" --tls-max 1.2", " --tlsv1.3"}) {
    const Said none = curl(*server, "https", ca + version);
    EXPECT_NE(none.code, 0) << none.text;
    EXPECT_EQ(none.text.find("answered"), std::string::npos) << version;
    const Said stranger = curl(*server, "https", ca + as("stranger") + version);
    EXPECT_NE(stranger.code, 0) << stranger.text;
    EXPECT_EQ(stranger.text.find("answered"), std::string::npos) << version;
  }
}

TEST_F(Tls, WhoNeverFinishesTheHandshakeIsDropped) {
  Limits limits;
  limits.deadline = std::chrono::milliseconds(300);
  auto server = Server::start("127.0.0.1", 0, Router({}, {}), limits, files());
  ASSERT_TRUE(server) << server.error().text();
  // Silent: the other end closes, and cat ends.
  const Said said = run("timeout 20 bash -c 'exec 3<>/dev/tcp/127.0.0.1/" +
                        std::to_string((*server)->port()) + "; cat <&3'");
  EXPECT_EQ(said.code, 0) << said.text;
  EXPECT_EQ((*server)->counts().closed, 1U);
}

TEST_F(Tls, WrongFilesAreNamed) {
  TlsFiles f = files();
  f.certificate = path("nothing.pem");
  EXPECT_EQ(refused(f).where, f.certificate);
  f = files();
  f.key = path("client.key");
  EXPECT_EQ(refused(f).where, f.key) << "of another certificate";
  f = files();
  f.certificate = f.key;
  EXPECT_EQ(refused(f).where, f.certificate) << "a key is no certificate";
  f = files(true);
  f.client_ca = f.key;
  EXPECT_EQ(refused(f).where, f.client_ca);
  must("cp " + path("server.key") + " " + path("open.key"));
  must("chmod 640 " + path("open.key"));
  f = files();
  f.key = path("open.key");
  EXPECT_EQ(refused(f).todo, "chmod 600 " + f.key);
  must("openssl ec -in " + path("server.key") + " -aes256 -passout pass:secret -out " +
       path("locked.key"));
  f.key = path("locked.key");
  EXPECT_EQ(refused(f).where, f.key) << "nobody is asked for a password";
}

TEST_F(Tls, ACertificateThatHasExpiredIsNotServed) {
  must(key_and_request("old") + " -out " + path("old.csr"));
  must("openssl x509 -req -days -1 -in " + path("old.csr") + " -CA " + path("ca.pem") + " -CAkey " +
       path("ca.key") + " -CAcreateserial -out " + path("old.pem"));
  const TlsFiles f{path("old.pem"), path("old.key"), ""};
  EXPECT_EQ(refused(f).what, "has expired");
}

}  // namespace
}  // namespace crane::http

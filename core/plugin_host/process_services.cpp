#include "plugin_host/process_services.h"

#include <string>

#include "plugin_host/guard.h"

namespace relign::plugin_host {
namespace {

Json unsupported(const std::string& what) {
  return {{"message", "unsupported"}, {"text", what + " is not offered to this algorithm, or not over messages"}};
}

std::string text_of(const Json& request, const char* member) {
  const auto found = request.find(member);
  return found != request.end() && found->is_string() ? found->get<std::string>() : "";
}

relign_text view(const std::string& text) { return {text.data(), text.size()}; }

// "refused" or "failed" with the service's own sentence.
template <class Service>
Json not_done(relign_status status, const Service& service) {
  TextSink sentence;
  service.why(service.context, sentence.sink());
  return {{"message", status == RELIGN_FAILED ? "failed" : "refused"}, {"text", sentence.text()}};
}

Json ask_measures(const Json& request, const relign_measures_service& measures) {
  const std::string call = text_of(request, "call");
  TextSink list;
  if (call == "list") {
    const relign_status status = measures.list(measures.context, list.sink());
    if (status != RELIGN_OK) return not_done(status, measures);
    return {{"message", "result"}, {"measures", Json::parse(list.text(), nullptr, false)}};
  }
  if (call != "measure") return unsupported("\"" + call + "\"");
  const std::string name = text_of(request, "name");
  const std::string arguments = request.value("arguments", Json::object()).dump();
  double value = 0;
  const relign_status status = measures.measure(measures.context, view(name), view(arguments), &value);
  if (status != RELIGN_OK) return not_done(status, measures);
  return {{"message", "result"}, {"value", value}};
}

Json ask_prior(const Json& request, const relign_prior_service& prior) {
  const auto number = request.find("number");
  if (number == request.end() || !number->is_number_unsigned())
    return {{"message", "refused"}, {"text", "expected a whole number \"number\" from 0"}};
  TextSink drawn;
  const relign_status status = prior.draw(prior.context, number->get<std::uint64_t>(), drawn.sink());
  if (status != RELIGN_OK) return not_done(status, prior);
  return {{"message", "result"}, {"drawn", Json::parse(drawn.text(), nullptr, false)}};
}

}  // namespace

Json answer_service_request(const Json& request, const relign_conversation& talk) {
  const std::string id = text_of(request, "service");
  const void* service = talk.get_service ? talk.get_service(talk.context, view(id)) : nullptr;
  if (service && id == RELIGN_SERVICE_MEASURES)
    return ask_measures(request, *static_cast<const relign_measures_service*>(service));
  if (service && id == RELIGN_SERVICE_PRIOR)
    return ask_prior(request, *static_cast<const relign_prior_service*>(service));
  return unsupported("\"" + id + "\"");
}

}  // namespace relign::plugin_host

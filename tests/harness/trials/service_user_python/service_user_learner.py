"""Calls services according to a script, and is pretrained."""
from relign_bench.plugin import serve
from service_user import ServiceUser


class ServiceUserLearner(ServiceUser):
    id = "service_user_learner_python"
    observes = ("merit", "start", "box")
    prepare = {"sources": 2, "steps": 4}


if __name__ == "__main__":
    serve(ServiceUserLearner)

"""Records a data directory with a released binary, so that a test can open it for ever.

Usage: keep_directory.py APPRENTICE_BINARY EMPTY_FOLDER
Needs pyzmq and msgpack. Makes two directories in the folder:

  data       two labs and the single-user tenant; every recipe that ships; lessons, a forgotten lesson, an
             erased person, retired and rotated keys, quotas, closed segments; one person in each phase
  shut-out   a person whom release 0.2 could not wake again: the goal held before the first utterance

Pack each with: tar --sort=name --owner=0 --group=0 --format=ustar -C FOLDER/data -cf - . | gzip -9n
"""
import os
import socket
import subprocess
import sys
import time

import msgpack
import zmq
import zmq.utils.z85

BINARY, FOLDER = sys.argv[1], sys.argv[2]
RECIPES = ["default", "paper", "grammar", "seq2seq", "seq2seq-grammar"]
CONTEXT = zmq.Context.instance()


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def run(*arguments):
    done = subprocess.run([BINARY, *arguments], capture_output=True, text=True, check=True)
    return done.stdout.strip()


class Client:
    def __init__(self, endpoint, key=None, server=None):
        self.socket = CONTEXT.socket(zmq.DEALER)
        self.socket.linger = 0
        if key:
            self.socket.curve_publickey, self.socket.curve_secretkey = key
            self.socket.curve_serverkey = server
        self.socket.connect(endpoint)

    def ask(self, user="operator", **verb):
        request = {"v": 1, "id": os.urandom(16), "user": user, **verb}
        for _ in range(60):
            self.socket.send(msgpack.packb(request))
            while self.socket.poll(10_000):
                response = msgpack.unpackb(self.socket.recv(), strict_map_key=False)
                if response["id"] != request["id"]:
                    continue
                if "busy" in response:
                    time.sleep(response["busy"]["retry_after_ms"] / 1000)
                    break
                return response
        sys.exit(f"no answer to {verb}")


class Service:
    def __init__(self, data, recipe, curve=None):
        endpoint = f"tcp://127.0.0.1:{free_port()}"
        command = [BINARY, "serve", "--data", data, "--zmq", endpoint, "--recipe", recipe]
        command += ["--curve", curve] if curve else []
        self.log = open(os.path.join(FOLDER, "serve.log"), "ab")
        self.process = subprocess.Popen(command, stdout=self.log, stderr=self.log)
        self.host = Client(endpoint)
        self.host.ask(query="hello")

    def stop(self):
        self.process.terminate()
        if self.process.wait(60) != 0:
            sys.exit("the service did not stop cleanly; see serve.log")


class Person:
    def __init__(self, client, name):
        self.client, self.name = client, name

    def do(self, command):
        return self.client.ask(self.name, command=command)

    def start(self, task, seed):
        answer = self.do({"start_episode": {"stage": {"task": {"task": task, "seed": seed}}}})
        assert "reply" in answer, answer

    def say(self, *utterances):
        for utterance in utterances:
            self.do({"say": {"utterance": utterance}})

    def status(self):
        return self.client.ask(self.name, query="status")["status"]

    def teach_what_was_not_understood(self):
        """Ends the episode, and teaches each utterance everything that was done after it."""
        if self.status()["phase"] == "interacting":
            self.do("done")
        first = None
        for said in self.status()["to_teach"]:
            done = [action["number"] for action in self.status()["actions"]]
            after = [number for number in done if number > said["actions_before"]]
            answer = self.do({"teach": {"explains": said["seq"], "actions": after, "on_clash": "ask"}})
            if "reply" in answer and after and first is None:
                first = answer["reply"]["first"]
        return first

    def learn(self):
        if self.status()["phase"] == "teaching":
            self.do("finish_teaching")
        self.client.ask(self.name, query={"wait": {"seconds": 30}})


def washes_a_mug(person, seed):
    person.start("clean Mug CounterTop", seed)
    person.say("wash the mug", "go to the mug and pick it up", "go to the sink",
               "put the mug in the sink", "turn on the faucet", "turn off the faucet",
               "pick up the mug")
    lesson = person.teach_what_was_not_understood()
    person.learn()
    return lesson


def cools_an_apple(person, seed):
    person.start("cool Apple CounterTop", seed)
    person.say("go to the apple", "pick up the apple", "chill it, please", "go to the fridge",
               "open the fridge", "put the apple in the fridge", "close the fridge",
               "open the fridge", "pick up the apple", "open the pantry")
    person.teach_what_was_not_understood()
    person.learn()


def a_life(client, name, seed):
    """Three episodes: two lessons, one of them used again and then taken back."""
    person = Person(client, name)
    lesson = washes_a_mug(person, seed)
    person.start("clean Tomato CounterTop", seed + 1)
    person.say("rinse the tomato", "wash the tomato", "pick up the tomato", "wash the tomato")
    person.teach_what_was_not_understood()
    person.learn()
    cools_an_apple(person, seed + 2)
    if lesson is not None:
        person.do({"forget": {"lesson": lesson}})
        person.learn()
    return person


def keep_data():
    data = os.path.join(FOLDER, "data")
    port = f"tcp://127.0.0.1:{free_port()}"
    keys = {}
    for number, recipe in enumerate(RECIPES):
        service = Service(data, recipe, port)
        host = service.host
        server = run("keys", "show", "--data", data).split()[-1].encode()
        if number == 0:
            for lab in ("mug-lab", "fridge-lab"):
                host.ask(order="add", tenant=lab)
                for role in ("gateway", "operator", "auditor"):
                    keys[lab, role] = zmq.curve_keypair()
                    key = zmq.utils.z85.decode(keys[lab, role][0])
                    admit = {"admit": {"key": key, "role": role, "label": f"{role} of {lab}"}}
                    host.ask(order=admit, tenant=lab)
            quotas = {"awake_users": 50, "utterances_per_second": 200, "sealed_bytes": 100_000_000}
            host.ask(order={"set_quotas": quotas}, tenant="mug-lab")
        labs = {lab: Client(port, keys[lab, "gateway"], server) for lab in ("mug-lab", "fridge-lab")}
        a_life(host, f"ada-{recipe}", 10 * number + 1)
        a_life(labs["mug-lab"], f"mia-{recipe}", 10 * number + 2)
        friend = Person(labs["fridge-lab"], f"fred-{recipe}")
        washes_a_mug(friend, 10 * number + 3)
        friend.start("place Apple DiningTable", 10 * number + 3)
        friend.say("pick up the apple", "polish the apple")
        if recipe == "default":
            gone = Person(labs["mug-lab"], "gone")
            washes_a_mug(gone, 77)
            host.ask(order={"erase": {"user": "gone"}}, tenant="mug-lab")
            asked = Person(host, "asked")
            asked.start("place Apple CounterTop", 5)
            asked.say("wash the apple", "pick up the apple")
            asked.do("done")
            left = Person(host, "left")
            left.start("place Apple CounterTop", 6)
            left.say("hello")
            left.do({"close": {"reason": "no time"}})
            # A key taken back at once, and one that was replaced, with an overlap.
            key = zmq.utils.z85.decode(keys["fridge-lab", "auditor"][0])
            host.ask(order={"retire": {"key": key}}, tenant="fridge-lab")
            old = zmq.utils.z85.decode(keys["mug-lab", "auditor"][0])
            keys["mug-lab", "auditor"] = zmq.curve_keypair()
            new = zmq.utils.z85.decode(keys["mug-lab", "auditor"][0])
            host.ask(order={"rotate": {"old": old, "new": new, "overlap_seconds": 2}}, tenant="mug-lab")
        service.stop()
        if recipe == "paper":
            for tenant in ("local", "mug-lab"):
                out = os.path.join(FOLDER, f"{tenant}.checkpoint")
                run("checkpoint", "--data", data, "--tenant", tenant, "--out", out)
    service = Service(data, "default", port)
    service.host.ask(order={"disable": {"reason": "the study is over"}}, tenant="fridge-lab")
    service.stop()
    print(run("audit", "--data", data, "--repropose", "--retrain"))


def keep_shut_out():
    data = os.path.join(FOLDER, "shut-out")
    service = Service(data, "default")
    person = Person(service.host, "ada")
    washes_a_mug(person, 3)
    scene = 'room = "kitchen"\n[[thing]]\ntype = "CounterTop"\n[[thing]]\ntype = "Mug"\non = "CounterTop"\n'
    person.do({"start_episode": {"stage": {"scene": {"scene": scene, "task": "place Mug CounterTop"}}}})
    print(person.do({"say": {"utterance": "hello"}}))
    service.stop()


keep_data()
keep_shut_out()

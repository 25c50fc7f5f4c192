"""A whole conversation with apprentice. Usage: conversation.py tcp://127.0.0.1:PORT [USER]"""
import os, sys, time, msgpack, zmq

socket = zmq.Context.instance().socket(zmq.DEALER)
socket.connect(sys.argv[1])
user = sys.argv[2] if len(sys.argv) > 2 else "ada"

def ask(**verb):
    request = {"v": 1, "id": os.urandom(16), "user": user, **verb}
    for attempt in range(6):  # Asking again with the same id is safe.
        socket.send(msgpack.packb(request))
        while socket.poll(10_000):
            response = msgpack.unpackb(socket.recv())
            if response["id"] != request["id"]: continue
            if "busy" not in response: return response
            time.sleep(response["busy"]["retry_after_ms"] / 1000); break
    sys.exit("no answer from " + sys.argv[1])

def start(task):
    things = ["CounterTop", "SinkBasin", "Faucet on SinkBasin", "Mug on CounterTop", "Apple on CounterTop"]
    things = "".join('[[thing]]\ntype = "{}"\n{}'.format(*t.split(" on ")[:1], f'on = "{t.split(" on ")[1]}"\n'
                     if " on " in t else "") for t in things)
    stage = {"scene": {"scene": 'room = "kitchen"\n' + things, "task": task}}
    print("goal:", ask(command={"start_episode": {"stage": stage}})["reply"]["told"][0]["episode_started"]["goal"])

def say(utterance):
    answer = ask(command={"say": {"utterance": utterance}})["reply"]["told"][0]["answered"]["answer"]
    outcome, evidence = answer["outcome"], answer["evidence"]
    unused = [word["word"] for word in evidence.get("accounting", []) if word["as"] == "nothing"]
    why = [evidence["mood"]] if "mood" in evidence else unused
    print(">", utterance, "\n=", outcome["understood"]["program"] if "understood" in outcome else outcome, *why)

start("place Mug SinkBasin")
for utterance in ["sterilize the mug", "go to the mug", "pick up the mug", "go to the sink"]: say(utterance)
ask(command="done"); status = ask(query="status")["status"]
lesson = {"explains": status["to_teach"][0]["seq"], "actions": [action["number"] for action in status["actions"]]}
print("taught:", ask(command={"teach": lesson})["reply"]["told"][0]["taught"]["program"])
ask(command="finish_teaching")
print("learned:", list(ask(query={"wait": {"seconds": 30}})["waited"]["told"][0]))
start("place Apple SinkBasin"); say("sterilize the apple")

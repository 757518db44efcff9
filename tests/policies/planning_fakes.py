"""Models with prescribed replies, over real HTTP, with OpenAI's and with Google's API."""

import base64
import hashlib
import io
import json
import os
import re
import threading
import time
from contextlib import contextmanager
from fractions import Fraction
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from types import SimpleNamespace

import av
import numpy as np

from roboirg.language import instruct
from roboirg.policies.vlm.models import ModelOptions
from roboirg.policies.vlm.vlm_listener import ListenerOptions, VLMListener

TOKENS = 100, 7
"""Input and output tokens of every reply."""
KEY_VARIABLE = "PLANNING_TEST_KEY"
KEY = "sk-very-secret-0123456789"


class Late:
    """Reply after some seconds; with drip=True, send a space every 50 ms meanwhile."""

    def __init__(self, seconds, drip=False):
        self.seconds = seconds
        self.drip = drip


class Status:
    """Reply with an HTTP error."""

    def __init__(self, code, words="something went wrong", headers=()):
        self.code, self.words, self.headers = code, words, dict(headers)


class Garbage:
    """Reply with something malformed."""

    def __init__(self, body, kind="application/json"):
        self.body = body
        self.kind = kind


class FakeVLM(ThreadingHTTPServer):
    """Replies with what a function returns for the request, and keeps all requests.

    Attributes:
        answer: from the body of a request to a text, or one of the mishaps above.
        requests: bodies, in the order of arrival.
    """

    daemon_threads = True

    def __init__(self, answer):
        super().__init__(("127.0.0.1", 0), _Handler)
        self.answer = answer
        self.requests = []
        self.headers = []

    @property
    def url(self):
        return f"http://127.0.0.1:{self.server_port}"


class _Handler(BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"
    wbufsize = -1  # whole replies at once: header and body apart wait 40 ms for each other

    def log_message(self, *args):
        pass

    def do_POST(self):
        body = json.loads(self.rfile.read(int(self.headers["Content-Length"])))
        self.server.requests.append(body)
        self.server.headers.append(dict(self.headers))
        said = self.server.answer(body)
        try:
            self._send(said)
        except (BrokenPipeError, ConnectionResetError):
            self.close_connection = True

    def _send(self, said):
        google = "generateContent" in self.path
        if isinstance(said, Status):
            error = {"error": {"message": said.words, "code": said.code, "status": "BAD"}}
            body = json.dumps(error).encode()
            return self._reply(said.code, body, "application/json", said.headers)
        if isinstance(said, Garbage):
            return self._reply(200, said.body, said.kind)
        if isinstance(said, Late) and said.drip:
            self.send_response(200)
            self.send_header("Content-Type", "application/json")
            self.send_header("Content-Length", "100000")
            self.end_headers()
            end = time.monotonic() + said.seconds
            while time.monotonic() < end:
                self.wfile.write(b" ")
                self.wfile.flush()
                time.sleep(0.05)
            self.close_connection = True
            return None
        if isinstance(said, Late):
            time.sleep(said.seconds)
            said = "{}"
        reply = google_reply(said) if google else openai_reply(said)
        return self._reply(200, json.dumps(reply).encode(), "application/json")

    def _reply(self, code, body, kind, headers=()):
        self.send_response(code)
        for name, value in dict(headers).items():
            self.send_header(name, value)
        self.send_header("Content-Type", kind)
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        self.wfile.write(body)


def openai_reply(text):
    message = {"role": "assistant", "content": text}
    return {
        "id": "1",
        "model": "gpt-4o",
        "choices": [{"message": message, "finish_reason": "stop"}],
        "usage": {
            "prompt_tokens": TOKENS[0],
            "completion_tokens": TOKENS[1],
            "total_tokens": sum(TOKENS),
        },
    }


def google_reply(text):
    return {
        "candidates": [
            {
                "content": {
                    "role": "model",
                    "parts": [{"text": "(thinking)", "thought": True}, {"text": text}],
                },
                "finishReason": "STOP",
            }
        ],
        "usageMetadata": {
            "promptTokenCount": TOKENS[0],
            "candidatesTokenCount": TOKENS[1] - 2,
            "thoughtsTokenCount": 2,
        },
    }


@contextmanager
def fake_vlm(answer):
    """Run a server that answers with what a function returns for a request, or from a list.

    The last reply of a list stays.
    """
    reply = answer
    if isinstance(answer, list):
        left = list(answer)

        def reply(_body):
            return left.pop(0) if len(left) > 1 else left[0]

    server = FakeVLM(reply)
    thread = threading.Thread(target=server.serve_forever, args=(0.01,), daemon=True)
    thread.start()
    try:
        yield server
    finally:
        server.shutdown()
        server.server_close()
        thread.join()


def model_options(server, provider="openai", **more):
    url = f"{server.url}/v1" if provider == "openai" else server.url
    never = {"retries": 0, "patience_s": 0}
    settings = {"model": "fake", "base_url": url, "timeout_s": 300.0, **never, **more}
    return ModelOptions(provider=provider, **settings)


def spent(policy):
    """What an episode cost, without the time that it took."""
    return {name: value for name, value in policy.usage().items() if not name.endswith("_s")}


def make_listener(server, provider="openai", **more):
    own = {key: more.pop(key) for key in list(more) if key in ListenerOptions.model_fields}
    return VLMListener(ListenerOptions(model=model_options(server, provider, **more), **own))


def words_of(body):
    """All text of a request, the last turn's last."""
    if "contents" in body:
        return "\n".join(
            part["text"] for turn in body["contents"] for part in turn["parts"] if "text" in part
        )
    texts = []
    for message in body["messages"]:
        content = message["content"]
        pieces = [{"type": "text", "text": content}] if isinstance(content, str) else content
        texts += [piece["text"] for piece in pieces if piece["type"] == "text"]
    return "\n".join(texts)


def stand_in(episode, setting="explicit", shade=0, unheard=0):
    """The part of an environment that a listener reads before it executes the goal."""
    picture = np.full((256, 256, 3), shade, np.uint8)
    return SimpleNamespace(
        episode=episode,
        instruction=instruct(episode, setting),
        picture=lambda camera: picture,
        grounded=True,
        unheard=unheard,
    )


def golden(body):
    """A request with every picture and clip replaced by a description of its content."""
    if isinstance(body, dict):
        if "data" in body:
            kind = body["mime_type"]
            return {"mimeType": kind, "data": _described(kind, body["data"])}
        return {key: golden(held) for key, held in body.items()}
    if isinstance(body, list):
        return [golden(held) for held in body]
    found = re.fullmatch(r"data:(.*?);base64,(.*)", body) if isinstance(body, str) else None
    return _described(found[1], found[2]) if found else body


CAPTURES = Path(__file__).parent / "captures" / "planning"


def check_sample(page, request, answer):
    """Compare a request, and a reply with an answer, with the blocks of JSON on a page of docs."""
    text = (Path(__file__).parents[2] / "docs" / page).read_text()
    blocks = re.findall(r"```json\n(.*?)```", text, re.DOTALL)
    assert list(map(json.loads, blocks)) == [request, openai_reply(answer)]


def check_capture(name, body):
    """Compare with the capture of that name; written anew where ROBOIRG_CAPTURE=1 says so."""
    file = CAPTURES / f"{name}.json"
    if os.environ.get("ROBOIRG_CAPTURE") == "1":
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(json.dumps(body, indent=1, ensure_ascii=False) + "\n")
    assert body == json.loads(file.read_text())


def _described(kind, data):
    frames, rate = decoded(base64.urlsafe_b64decode(data.replace("+", "-").replace("/", "_")))
    if kind == "video/mp4":
        return f"<{kind}, {len(frames)} frames of {frames.shape[1:3]} at {rate}>"
    digest = hashlib.sha256(frames[0].tobytes()).hexdigest()[:8]
    return f"<{kind}, {frames.shape[1:3]}, pixels {digest}>"


def decoded(content):
    """Frames (T, height, width, 3) of a file, and its rate."""
    with av.open(io.BytesIO(content)) as container:
        rate = container.streams.video[0].average_rate  # a rational of the library's own
        frames = [frame.to_ndarray(format="rgb24") for frame in container.decode(video=0)]
    return np.stack(frames), Fraction(rate.numerator, rate.denominator)

// Reads a log as Foxglove and Lichtblick do (@mcap/core, wasm-zstd, protobufjs) and prints what it found as JSON:
// messages by topic, the last message of each viewer's topic decoded, and the names of the frames that move.

import { readFile } from "node:fs/promises";
import { McapIndexedReader, McapStreamReader } from "@mcap/core";
import zstd from "@foxglove/wasm-zstd";
import protobuf from "protobufjs";
import descriptor from "protobufjs/ext/descriptor/index.js";

await zstd.isLoaded;
const decompressHandlers = { zstd: (data, size) => zstd.decompress(data, Number(size)) };
const bytes = new Uint8Array(await readFile(process.argv[2]));

/** A file in memory, as the indexed reader wants it. */
const readable = {
  size: async () => BigInt(bytes.length),
  read: async (offset, length) => bytes.subarray(Number(offset), Number(offset) + Number(length)),
};

/** Decoder of a schema's messages, made from the declaration in the file alone. */
function decoder(schema) {
  const set = descriptor.FileDescriptorSet.decode(schema.data);
  const type = protobuf.Root.fromDescriptor(set).lookupType(schema.name);
  return (data) => type.toObject(type.decode(data), { longs: Number, enums: String, defaults: true, arrays: true });
}

const count = {};
const last = {};
const decoders = new Map();
const reader = await McapIndexedReader.Initialize({ readable, decompressHandlers });
for await (const message of reader.readMessages()) {
  const channel = reader.channelsById.get(message.channelId);
  const schema = reader.schemasById.get(channel.schemaId);
  count[channel.topic] = (count[channel.topic] ?? 0) + 1;
  if (channel.messageEncoding !== "protobuf") continue;
  if (!decoders.has(schema.id)) decoders.set(schema.id, decoder(schema));
  const decoded = decoders.get(schema.id)(message.data);
  if (channel.topic.startsWith("/")) last[channel.topic] = decoded;
}

// Once more from end to end without the index, checksums and all.
let streamed = 0;
const stream = new McapStreamReader({ decompressHandlers, validateCrcs: true });
stream.append(bytes);
for (let record; (record = stream.nextRecord()); ) streamed += record.type === "Message" ? 1 : 0;

const moved = (last["/tf"]?.transforms ?? []).map((transform) => transform.child_frame_id);
const picture = last["/camera"];
const cloud = last["/cloud"];
console.log(
  JSON.stringify({
    count,
    streamed,
    done: stream.done(),
    moved,
    lastMotionS: last["/tf"] && last["/tf"].transforms[0].timestamp.seconds + 1e-9 * last["/tf"].transforms[0].timestamp.nanos,
    entities: last["/scene"]?.entities.length,
    lastLine: last["/log"]?.message,
    picture: picture && { frame: picture.frame_id, format: picture.format, bytes: picture.data.length },
    cloud: cloud && { frame: cloud.frame_id, points: cloud.data.length / cloud.point_stride },
  }),
);

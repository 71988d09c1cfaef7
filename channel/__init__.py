"""The link: rate, delay, blackouts, queues, messages and their codecs."""

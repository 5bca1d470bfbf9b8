// gocanopen as the master of one node: `gocanopen INTERFACE NODE COMMAND ...`. Prints what came back; numbers are hexadecimal.
//
//	read INDEX SUB | read-block INDEX SUB | write INDEX SUB BYTES | write-block INDEX SUB BYTES | scan | nmt COMMAND
//	domain INDEX: writes what comes on its input, by blocks, and reads it back
//	pdo EDS: RPDO 1 and TPDO 1 at every SYNC; then, line by line, `get INDEX` and `set INDEX BYTES` of its copy of the objects
//	beside OWN: with a node of its own, which sends SYNC and TIME; tells heartbeats and emergencies until its input ends
package main

import (
	"bufio"
	"bytes"
	"encoding/hex"
	"fmt"
	"io"
	"log"
	"log/slog"
	"os"
	"sort"
	"strconv"
	"time"

	"github.com/samsamfire/gocanopen/v2/pkg/network"
	"github.com/samsamfire/gocanopen/v2/pkg/nmt"
	"github.com/samsamfire/gocanopen/v2/pkg/od"
	pdos "github.com/samsamfire/gocanopen/v2/pkg/pdo"
)

const (
	patience       = 10_000 // [ms]
	syncPeriod     = 10 * time.Millisecond
	timePeriod     = 100 * time.Millisecond
	heartbeatAwait = 10 * time.Second
	emergencies    = 0x80
	shortTurn      = 10 * time.Microsecond
	manyTurns      = 4_000_000 // [ms]
)

var commands = map[string]nmt.Command{
	"start":               nmt.CommandEnterOperational,
	"stop":                nmt.CommandEnterStopped,
	"pre-operational":     nmt.CommandEnterPreOperational,
	"reset-node":          nmt.CommandResetNode,
	"reset-communication": nmt.CommandResetCommunication,
}

// number reads a hexadecimal one; an error ends the program.
func number(text string) uint64 {
	value, err := strconv.ParseUint(text, 16, 32)
	must(err)
	return value
}

func must(err error) {
	if err != nil {
		fmt.Println("error:", err)
		os.Exit(0)
	}
}

func read(bus *network.Network, node uint8, index uint16, subindex uint8, block bool) []byte {
	if block {
		data, err := bus.ReadAll(node, index, subindex)
		must(err)
		return data
	}
	data := make([]byte, 1<<16)
	length, err := bus.ReadRaw(node, index, subindex, data)
	must(err)
	return data[:length]
}

func write(bus *network.Network, node uint8, index uint16, subindex uint8, block bool, text string) {
	data, err := hex.DecodeString(text)
	must(err)
	to, err := bus.NewRawWriter(node, index, subindex, block, uint32(len(data)))
	must(err)
	_, err = to.Write(data)
	must(err)
}

// domain transfers a segment a turn; a turn sleeps a shorter time than usual and still counts as one of 10 ms for its timeouts.
func domain(bus *network.Network, node uint8, index uint16) {
	bus.SDOClient.SetProcessingPeriod(shortTurn)
	bus.SDOClient.SetTimeout(manyTurns)
	bus.SDOClient.SetTimeoutBlockTransfer(manyTurns)
	data, err := io.ReadAll(os.Stdin)
	must(err)
	to, err := bus.NewRawWriter(node, index, 0, true, uint32(len(data)))
	must(err)
	_, err = to.Write(data)
	must(err)
	if bytes.Equal(read(bus, node, index, 0, true), data) {
		fmt.Println("as written")
	}
}

func scan(bus *network.Network) {
	found, err := bus.Scan(patience)
	must(err)
	nodes := []int{}
	for node := range found {
		nodes = append(nodes, int(node))
	}
	sort.Ints(nodes)
	for _, node := range nodes {
		told := found[uint8(node)]
		fmt.Printf("%d %x %s\n", node, told.Identity.SerialNumber, told.ManufacturerInformation.ManufacturerDeviceName)
	}
}

func pdo(bus *network.Network, id uint8, eds string) {
	settings := bus.Configurator(id)
	for _, number := range []uint16{1, pdos.MaxRpdoNumber + 1} {
		configuration, err := settings.ReadConfigurationPDO(number)
		must(err)
		configuration.TransmissionType = 1
		must(settings.DisablePDO(number))
		must(settings.WriteConfigurationPDO(number, configuration))
		must(settings.EnablePDO(number))
	}
	node, err := bus.AddRemoteNode(id, eds)
	must(err)
	must(node.StartPDOs(false))
	fmt.Println("ready")
	for lines := bufio.NewScanner(os.Stdin); lines.Scan(); {
		var word, object, text string
		fmt.Sscan(lines.Text(), &word, &object, &text)
		index := uint16(number(object))
		if word == "get" {
			data, err := node.ReadBytes(index, 0)
			must(err)
			fmt.Println(hex.EncodeToString(data))
			continue
		}
		data, err := hex.DecodeString(text)
		must(err)
		must(node.GetOD().Index(index).WriteExactly(0, data, true))
		fmt.Println("done")
	}
}

func beside(bus *network.Network, id uint8, own uint8) {
	node, err := bus.CreateLocalNode(own, od.Default())
	must(err)
	node.EMCY.SetCallback(func(ident, code uint16, register, _ byte, _ uint32) {
		fmt.Printf("emergency %x %x %x\n", ident, code, register)
	})
	_, err = bus.Subscribe(emergencies+uint32(id), 0x7FF, false, node.EMCY)
	must(err)
	// Its documentation names the node second; the node comes first (single_consumer.go).
	node.HBConsumer.OnEvent(func(_, of, _, state uint8) { fmt.Printf("heartbeat of %d: %x\n", of, state) })
	settings := node.Configurator()
	must(settings.WriteMonitoredNode(1, id, heartbeatAwait))
	must(settings.ProducerEnableTIME())
	node.TIME.SetProducerInterval(timePeriod)
	must(settings.WriteCommunicationPeriod(syncPeriod))
	must(settings.ProducerEnableSYNC())
	fmt.Println("ready")
	_, err = io.ReadAll(os.Stdin)
	must(err)
}

func main() {
	slog.SetDefault(slog.New(slog.NewTextHandler(io.Discard, nil)))
	words := os.Args[1:]
	bus := network.NewNetwork(nil)
	if err := bus.Connect("socketcan", words[0], 0); err != nil {
		log.Fatal(err)
	}
	bus.SDOClient.SetTimeout(patience)
	bus.SDOClient.SetTimeoutBlockTransfer(patience)
	node := uint8(number(words[1]))
	switch words = words[2:]; words[0] {
	case "scan":
		scan(&bus)
	case "domain":
		domain(&bus, node, uint16(number(words[1])))
	case "nmt":
		must(bus.Command(node, commands[words[1]]))
		fmt.Println("done")
	case "pdo":
		pdo(&bus, node, words[1])
	case "beside":
		beside(&bus, node, uint8(number(words[1])))
	case "read", "read-block":
		data := read(&bus, node, uint16(number(words[1])), uint8(number(words[2])), words[0] == "read-block")
		fmt.Println(hex.EncodeToString(data))
	case "write", "write-block":
		write(&bus, node, uint16(number(words[1])), uint8(number(words[2])), words[0] == "write-block", words[3])
		fmt.Println("done")
	}
	bus.Disconnect()
}
